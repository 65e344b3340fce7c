// The same scenes without an engine and without a wall: what the pictures must be.

import { Camera } from "../../../src/camera.ts";
import { Player } from "../../../src/player.ts";
import { BACKGROUND, FOV_Y, SIZE, clamped, nothing } from "./stage.js";

const linear = (v) => (v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const display = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);

/** A premultiplied colour over another: both as displayed, blended as they are or in linear light. */
function over(value, alpha, below, inLinear) {
  if (!inLinear || alpha === 0) return value + (1 - alpha) * below;
  return display(linear(value / alpha) * alpha + (1 - alpha) * linear(below));
}

/** By loops over all quads, which are in `floats` as in a WebGL2 player's QuadSource. */
function mostAlpha(floats, count, clipDepth) {
  const most = new Array(SIZE * SIZE).fill(0);
  for (let at = 0; at < 12 * count; at += 12) {
    const [x, y, depth, opacity, xx, xy, yy] = floats.subarray(at, at + 7);
    if (!(depth < clipDepth)) continue;
    for (let i = 0; i < most.length; i++) {
      const dx = (i % SIZE) - x, dy = Math.floor(i / SIZE) - y;
      const power = -(xx * dx * dx + yy * dy * dy) / 2 - xy * dx * dy;
      if (power <= 0) most[i] = Math.max(most[i], Math.min(0.99, opacity * Math.exp(power)));
    }
  }
  return most;
}

export async function makeStage(options) {
  const player = await Player.create(null, { backend: options.api });
  const camera = new Camera();
  camera.orbit([0, 0, 0], options.distance, 0, 0, FOV_Y, SIZE, SIZE);
  return {
    newer: false,
    add(avatar, level = 0) {
      const instance = player.add(avatar, { level });
      return {
        place(x, y, z, yaw, scale) {
          const c = scale * Math.cos(yaw), s = scale * Math.sin(yaw);
          instance.place.set([c, 0, s, x, 0, scale, 0, y, -s, 0, c, z, 0, 0, 0, 1]);
        },
        show: (visible) => void (instance.visible = visible),
        attach: (attached) => void (instance.visible = attached),
        seen: () => [instance.heightPx(camera), instance.levelFor(camera)],
        dispose: () => instance.dispose(),
        light: (light) => void (instance.light = light),
      };
    },
    draw: () => player.frame(camera, null),
    finished: () => player.finished(),
    async read() {
      const image = await player.readPixels();
      return clamped(image.map((value, i) => {
        if (i % 4 === 3) return 255;
        const alpha = image[i - (i % 4) + 3];
        return Math.round(255 * over(value, alpha, BACKGROUND[i % 4] / 255, options.linear === true));
      }));
    },
    dense(z) {
      const { quads, count } = player.renderer.source;
      const { clipFromWorld: clip } = camera;
      return mostAlpha(quads, count, (clip[10] * z + clip[11]) / (clip[14] * z + clip[15]));
    },
    wall: nothing,
    part: nothing,
    orthographic: nothing,
    lose: async () => undefined,
    disposeAvatars: () => player.dispose(),
    errors: async () => [],
  };
}
