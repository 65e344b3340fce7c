// The same scenes without an engine and without a wall: what the pictures must be.

import { Camera } from "../../../src/camera.js";
import { Player } from "../../../src/player.js";
import { BACKGROUND, FOV_Y, SIZE, clamped, type Stage, type StageOptions } from "./stage.js";

const linear = (v: number): number => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const display = (v: number): number => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);

/** A premultiplied colour over another: both as displayed, blended as they are or in linear light. */
function over(value: number, alpha: number, below: number, inLinear: boolean): number {
  if (!inLinear || alpha === 0) return value + (1 - alpha) * below;
  return display(linear(value / alpha) * alpha + (1 - alpha) * linear(below));
}

export async function makeStage(options: StageOptions): Promise<Stage> {
  const player = await Player.create(null, { backend: options.api });
  const camera = new Camera();
  camera.orbit([0, 0, 0], options.distance, 0, 0, FOV_Y, SIZE, SIZE);
  return {
    add(avatar) {
      const instance = player.add(avatar);
      return {
        place(x, y, z, yaw, scale) {
          const c = scale * Math.cos(yaw), s = scale * Math.sin(yaw);
          instance.world.set([c, 0, s, x, 0, scale, 0, y, -s, 0, c, z, 0, 0, 0, 1]);
        },
        show: (visible) => void (instance.visible = visible),
        dispose: () => instance.dispose(),
      };
    },
    wall: () => undefined,
    async picture() {
      player.frame(camera, null);
      await player.finished();
      const image = await player.readPixels();
      const bytes = Array.from(image, (value, i) => {
        if (i % 4 === 3) return 255;
        const alpha = image[i - (i % 4) + 3] as number;
        return Math.round(255 * over(value, alpha, BACKGROUND[(i % 4) as 0 | 1 | 2] / 255, options.linear === true));
      });
      return clamped(bytes);
    },
    disposeAvatars: () => player.dispose(),
    errors: async () => [],
  };
}
