import * as THREE from "three/webgpu";
import { AvatarScene } from "../../../src/three.js";
import { BACKGROUND, FOV_Y, SIZE, WALL, clamped, flipped, type Stage, type StageOptions } from "./stage.js";
import { QuietCanvas, watchErrors } from "./gpu.js";

const colour = ([r, g, b]: readonly number[]): THREE.Color => new THREE.Color().setRGB(r! / 255, g! / 255, b! / 255, THREE.SRGBColorSpace);

/** A target holds linear light. */
export async function makeStage(options: StageOptions): Promise<Stage> {
  const canvas = new QuietCanvas();
  const renderer = new THREE.WebGPURenderer({ canvas: canvas.element, antialias: options.antialias, forceWebGL: options.api === "webgl2", reversedDepthBuffer: options.reversed === true });
  renderer.setSize(SIZE, SIZE);
  await renderer.init();
  const errors = watchErrors((renderer.backend as unknown as { device?: GPUDevice }).device);
  const scene = new THREE.Scene();
  scene.background = colour(BACKGROUND);
  const camera = new THREE.PerspectiveCamera((FOV_Y * 180) / Math.PI, 1, options.distance / 50, options.distance * 5);
  camera.position.z = options.distance;
  const plane = new THREE.Mesh(new THREE.PlaneGeometry(8, 8), new THREE.MeshBasicMaterial({ color: colour(WALL) }));
  scene.add(plane);
  const avatars = await AvatarScene.create(renderer, { synchronous: options.synchronous });
  scene.add(avatars);
  const target = !options.target ? null : new THREE.RenderTarget(SIZE, SIZE, { type: THREE.HalfFloatType, samples: options.antialias ? 4 : 0 });
  return {
    add(avatar) {
      const head = avatars.add(avatar);
      return {
        place(x, y, z, yaw, scale) {
          head.position.set(x, y, z);
          head.rotation.y = yaw;
          head.scale.setScalar(scale);
        },
        show: (visible) => void (head.visible = visible),
        dispose: () => head.dispose(),
      };
    },
    wall(z) {
      plane.visible = z !== null;
      plane.position.set(-4, 0, z ?? 0);
    },
    async picture() {
      renderer.setRenderTarget(target);
      renderer.render(scene, camera);
      await avatars.finished();
      renderer.render(scene, camera);
      if (target === null) return canvas.read();
      const halves = (await renderer.readRenderTargetPixelsAsync(target, 0, 0, SIZE, SIZE)) as Uint16Array;
      const c = new THREE.Color();
      const bytes = Array.from(halves, (half, i) => {
        const value = THREE.DataUtils.fromHalfFloat(half);
        return Math.round(255 * (i % 4 === 3 ? value : c.setRGB(value, 0, 0).convertLinearToSRGB().r));
      });
      return options.api === "webgl2" ? flipped(bytes) : clamped(bytes);
    },
    disposeAvatars: () => avatars.dispose(),
    errors,
  };
}
