import * as pc from "playcanvas";
import { AvatarScene } from "../../../src/playcanvas.js";
import { BACKGROUND, FOV_Y, SIZE, WALL, flipped, glErrors, loseContext, readCanvas, type Stage, type StageOptions } from "./stage.js";

const colour = ([r, g, b]: readonly number[]): pc.Color => new pc.Color(r! / 255, g! / 255, b! / 255);

/** The scene on any device. `read` gets what was drawn last. */
export async function sceneOf(device: pc.GraphicsDevice, options: StageOptions, read: (target: pc.RenderTarget | null) => Promise<Uint8Array>, errors: Stage["errors"]): Promise<Stage> {
  const app = new pc.AppBase(device.canvas as HTMLCanvasElement);
  const settings = new pc.AppOptions();
  settings.graphicsDevice = device;
  settings.componentSystems = [pc.RenderComponentSystem, pc.CameraComponentSystem];
  app.init(settings);
  app.start();
  app.autoRender = false;
  const target = options.target ? new pc.RenderTarget({ colorBuffer: new pc.Texture(device, { width: SIZE, height: SIZE, format: pc.PIXELFORMAT_RGBA8, mipmaps: false }), depth: true, samples: options.antialias ? 4 : 1 }) : null;
  const camera = new pc.Entity("camera");
  camera.addComponent("camera", { clearColor: colour(BACKGROUND), fov: (FOV_Y * 180) / Math.PI, nearClip: options.distance / 50, farClip: options.distance * 5 });
  if (target !== null) camera.camera!.renderTarget = target;
  camera.setPosition(0, 0, options.distance);
  app.root.addChild(camera);
  const material = new pc.StandardMaterial();
  material.useLighting = false;
  material.emissive = colour(WALL);
  material.cull = pc.CULLFACE_NONE;
  material.update();
  const plane = new pc.Entity("wall");
  plane.addComponent("render", { type: "plane", material });
  plane.setLocalScale(8, 8, 8);
  plane.setEulerAngles(90, 0, 0);
  app.root.addChild(plane);
  const avatars = await AvatarScene.create(app, { synchronous: options.synchronous });
  let newer = false;
  avatars.onUpdate = () => (newer = true);
  return {
    add(avatar) {
      const head = avatars.add(avatar);
      return {
        place(x, y, z, yaw, scale) {
          head.setPosition(x, y, z);
          head.setEulerAngles(0, (yaw * 180) / Math.PI, 0);
          head.setLocalScale(scale, scale, scale);
        },
        show: (visible) => void (head.visible = visible),
        dispose: () => head.dispose(),
      };
    },
    wall(z) {
      plane.enabled = z !== null;
      plane.setPosition(-4, 0, z ?? 0);
    },
    async picture() {
      do {
        newer = false;
        app.render();
        await avatars.finished();
      } while (newer);
      app.render();
      return read(target);
    },
    orthographic: (on) => void (camera.camera!.projection = on ? pc.PROJECTION_ORTHOGRAPHIC : pc.PROJECTION_PERSPECTIVE),
    disposeAvatars: () => avatars.dispose(),
    errors,
  };
}

export async function makeStage(options: StageOptions): Promise<Stage> {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = SIZE;
  const device = await pc.createGraphicsDevice(canvas, { deviceTypes: ["webgl2"], antialias: options.antialias, preserveDrawingBuffer: true } as object);
  device.maxPixelRatio = 1;
  const gl = canvas.getContext("webgl2") as WebGL2RenderingContext;
  const read = async (target: pc.RenderTarget | null): Promise<Uint8Array> => {
    if (target === null) return readCanvas(gl);
    return flipped((await target.colorBuffer!.read(0, 0, SIZE, SIZE, { immediate: true })) as Uint8Array);
  };
  const stage = await sceneOf(device, options, read, async () => glErrors(gl));
  return { ...stage, lose: () => loseContext(gl) };
}
