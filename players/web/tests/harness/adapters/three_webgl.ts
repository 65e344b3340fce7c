import * as THREE from "three";
import { AvatarScene } from "../../../src/three.js";
import { BACKGROUND, FOV_Y, SIZE, WALL, flipped, glErrors, loseContext, readCanvas, type Stage, type StageOptions } from "./stage.js";

const colour = ([r, g, b]: readonly number[]): THREE.Color => new THREE.Color().setRGB(r! / 255, g! / 255, b! / 255, THREE.SRGBColorSpace);

export async function makeStage(options: StageOptions): Promise<Stage> {
  const renderer = new THREE.WebGLRenderer({ antialias: options.antialias, reversedDepthBuffer: options.reversed === true });
  renderer.setSize(SIZE, SIZE);
  const gl = renderer.getContext() as WebGL2RenderingContext;
  const scene = new THREE.Scene();
  scene.background = colour(BACKGROUND);
  const camera = new THREE.PerspectiveCamera((FOV_Y * 180) / Math.PI, 1, options.distance / 50, options.distance * 5);
  camera.position.z = options.distance;
  let seenBy: THREE.Camera = camera;
  const plane = new THREE.Mesh(new THREE.PlaneGeometry(8, 8), new THREE.MeshBasicMaterial({ color: colour(WALL) }));
  scene.add(plane);
  const avatars = await AvatarScene.create(renderer, { synchronous: options.synchronous });
  scene.add(avatars);
  const target = options.target ? new THREE.WebGLRenderTarget(SIZE, SIZE, { type: THREE.FloatType, samples: options.antialias ? 4 : 0 }) : null;
  let newer = false;
  avatars.onUpdate = () => (newer = true);
  const read = (): Uint8Array => {
    if (target === null) return readCanvas(gl);
    const floats = new Float32Array(4 * SIZE * SIZE);
    renderer.readRenderTargetPixels(target, 0, 0, SIZE, SIZE, floats);
    const display = floats.map((value, i) => 255 * (i % 4 === 3 ? value : new THREE.Color(value, 0, 0).convertLinearToSRGB().r));
    return flipped(display.map(Math.round));
  };
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
      do {
        newer = false;
        renderer.setRenderTarget(target);
        renderer.render(scene, seenBy);
        await avatars.finished();
      } while (newer);
      renderer.render(scene, seenBy);
      return read();
    },
    lose: () => loseContext(gl),
    orthographic: (on) => void (seenBy = on ? new THREE.OrthographicCamera(-1, 1, 1, -1, -1, 1) : camera),
    disposeAvatars: () => avatars.dispose(),
    errors: async () => glErrors(gl),
  };
}
