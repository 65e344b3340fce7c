import { Engine } from "@babylonjs/core/Engines/engine.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { StandardMaterial } from "@babylonjs/core/Materials/standardMaterial.js";
import { RenderTargetTexture } from "@babylonjs/core/Materials/Textures/renderTargetTexture.js";
import { Color3, Color4 } from "@babylonjs/core/Maths/math.color.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreatePlane } from "@babylonjs/core/Meshes/Builders/planeBuilder.js";
import { Scene } from "@babylonjs/core/scene.js";
import type { AbstractEngine } from "@babylonjs/core/Engines/abstractEngine.js";
import { AvatarScene } from "../../../src/babylon.js";
import { BACKGROUND, FOV_Y, SIZE, WALL, flipped, glErrors, loseContext, readCanvas, type Stage, type StageOptions } from "./stage.js";

const colour = ([r, g, b]: readonly number[]): Color3 => new Color3(r! / 255, g! / 255, b! / 255);

/** The scene of any engine. Right-handed, it equals those of the other engines. */
export async function sceneOf(engine: AbstractEngine, options: StageOptions, read: (target: RenderTargetTexture | null) => Promise<Uint8Array>, errors: Stage["errors"]): Promise<Stage> {
  const scene = new Scene(engine);
  scene.useRightHandedSystem = options.leftHanded !== true;
  scene.clearColor = Color4.FromColor3(colour(BACKGROUND), 1);
  const camera = new FreeCamera("camera", new Vector3(0, 0, options.distance), scene);
  camera.setTarget(Vector3.Zero());
  camera.fov = FOV_Y;
  camera.minZ = options.distance / 50;
  camera.maxZ = options.distance * 5;
  const target = options.target ? new RenderTargetTexture("target", SIZE, scene, { generateMipMaps: false }) : null;
  if (target !== null) {
    target.samples = options.antialias ? 4 : 1;
    target.clearColor = scene.clearColor;
    camera.outputRenderTarget = target;
  }
  const plane = CreatePlane("wall", { size: 8, sideOrientation: 2 }, scene);
  const material = new StandardMaterial("wall", scene);
  material.disableLighting = true;
  material.emissiveColor = colour(WALL);
  plane.material = material;
  const avatars = await AvatarScene.create(scene, { synchronous: options.synchronous });
  let newer = false;
  avatars.onUpdate = () => (newer = true);
  await scene.whenReadyAsync();
  const draw = (): void => {
    engine.beginFrame();
    scene.render();
    engine.endFrame();
  };
  return {
    add(avatar) {
      const head = avatars.add(avatar);
      return {
        place(x, y, z, yaw, scale) {
          head.position.set(x, y, z);
          head.rotation.y = yaw;
          head.scaling.setAll(scale);
        },
        show: (visible) => void (head.visible = visible),
        dispose: () => head.dispose(),
      };
    },
    wall(z) {
      plane.setEnabled(z !== null);
      plane.position.set(-4, 0, z ?? 0);
    },
    async picture() {
      do {
        newer = false;
        draw();
        await avatars.finished();
      } while (newer);
      draw();
      return read(target);
    },
    orthographic: (on) => void (camera.mode = on ? FreeCamera.ORTHOGRAPHIC_CAMERA : FreeCamera.PERSPECTIVE_CAMERA),
    disposeAvatars: () => avatars.dispose(),
    errors,
  };
}

export async function makeStage(options: StageOptions): Promise<Stage> {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIZE;
  const engine = new Engine(canvas, options.antialias, {}, false);
  const gl = canvas.getContext("webgl2") as WebGL2RenderingContext;
  const read = async (target: RenderTargetTexture | null): Promise<Uint8Array> =>
    target === null ? readCanvas(gl) : flipped(new Uint8Array((await target.readPixels())!.buffer));
  const stage = await sceneOf(engine, options, read, async () => glErrors(gl));
  return { ...stage, lose: () => loseContext(gl) };
}
