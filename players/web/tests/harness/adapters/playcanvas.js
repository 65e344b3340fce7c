import * as pc from "playcanvas";
import { AvatarScene } from "../../../src/playcanvas.ts";
import { QuietCanvas, watchErrors } from "./gpu.js";
import { BACKGROUND, FOV_Y, MAP, RADIUS, SIZE, WALL, flipped, fovOf, makeCanvas, numbersOf, optionsOf, setPose, webGl } from "./stage.js";

const colour = ([r, g, b]) => new pc.Color(r / 255, g / 255, b / 255);

function lampOf({ kind, colour, intensity, casts = false, ...where }) {
  const entity = new pc.Entity(kind);
  const type = { sun: "directional", bulb: "omni", spot: "spot" }[kind];
  const cone = { outerConeAngle: (where.angle * 180) / Math.PI, innerConeAngle: (where.angle * 100) / Math.PI };
  const falloff = { range: where.range, falloffMode: where.linear ? pc.LIGHTFALLOFF_LINEAR : pc.LIGHTFALLOFF_INVERSESQUARED };
  const color = new pc.Color(...colour.map((value) => value ** (1 / 2.2)));
  entity.addComponent("light", { type, color, intensity, castShadows: casts, shadowResolution: MAP.texels, shadowDistance: MAP.far, ...(kind === "sun" ? {} : falloff), ...(kind === "spot" ? cone : {}) });
  if (where.at) entity.setPosition(...where.at);
  const down = new pc.Vec3(...(where.towards ?? where.at)).normalize(); // it shines along its own -y
  const turn = new pc.Quat().setFromDirections(new pc.Vec3(0, 1, 0), down);
  entity.setRotation(turn);
  return entity;
}

async function byWebGl({ antialias }) {
  const canvas = makeCanvas();
  const device = await pc.createGraphicsDevice(canvas, { deviceTypes: ["webgl2"], antialias, preserveDrawingBuffer: true });
  return { device, ...webGl(canvas.getContext("webgl2")) };
}

async function byWebGpu({ antialias }) {
  const canvas = new QuietCanvas();
  const device = await pc.createGraphicsDevice(canvas.element, { deviceTypes: ["webgpu"], antialias });
  return { device, errors: watchErrors(device.wgpu), lose: async () => undefined, read: () => canvas.read() };
}

export async function makeStage(options) {
  const { device, ...drawing } = options.api === "webgpu" ? await byWebGpu(options) : await byWebGl(options);
  device.maxPixelRatio = 1;
  const app = new pc.AppBase(device.canvas);
  const settings = new pc.AppOptions();
  settings.graphicsDevice = device;
  settings.componentSystems = [pc.RenderComponentSystem, pc.CameraComponentSystem, pc.LightComponentSystem];
  app.init(settings);
  app.start();
  app.autoRender = false;
  const colorBuffer = options.target ? new pc.Texture(device, { width: SIZE, height: SIZE, format: pc.PIXELFORMAT_RGBA8, mipmaps: false }) : null;
  const camera = new pc.Entity("camera");
  camera.addComponent("camera", { clearColor: colour(BACKGROUND), fov: (FOV_Y * 180) / Math.PI, nearClip: options.distance / 50, farClip: options.distance * 5 });
  if (colorBuffer !== null) camera.camera.renderTarget = new pc.RenderTarget({ colorBuffer, depth: true, samples: options.antialias ? 4 : 1 });
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
  const blended = material.clone();
  blended.blendType = pc.BLEND_NORMAL;
  blended.update();
  const pane = new pc.Entity("pane");
  pane.addComponent("render", { type: "plane", material: blended, layers: [pc.LAYERID_IMMEDIATE] });
  pane.setLocalScale(8, 8, 8);
  pane.setEulerAngles(90, 0, 0);
  pane.enabled = false;
  app.root.addChild(pane);
  const white = new pc.StandardMaterial();
  white.useMetalness = false;
  white.specular = pc.Color.BLACK;
  white.update();
  const ball = new pc.Entity("ball");
  const round = pc.Mesh.fromGeometry(device, new pc.SphereGeometry({ radius: RADIUS, latitudeBands: 64, longitudeBands: 64 }));
  ball.addComponent("render", { meshInstances: [new pc.MeshInstance(round, white)], castShadows: false, receiveShadows: false });
  ball.enabled = false;
  const floor = new pc.Entity("floor");
  floor.addComponent("render", { type: "plane", material: white, castShadows: false });
  floor.setLocalScale(8, 8, 8);
  floor.setEulerAngles(90, 0, 0);
  floor.enabled = false;
  app.root.addChild(floor);
  const lamps = new pc.Entity("lamps");
  app.root.addChild(ball);
  app.root.addChild(lamps);
  const group = new pc.Entity("group");
  app.root.addChild(group);
  const avatars = await AvatarScene.create(app, optionsOf(options));
  const stage = {
    ...drawing,
    newer: false,
    add(avatar, level = 0) {
      const head = avatars.addAvatar(avatar, { level });
      return {
        place(x, y, z, yaw, scale) {
          head.setPosition(x, y, z);
          head.setEulerAngles(0, (yaw * 180) / Math.PI, 0);
          head.setLocalScale(scale, scale, scale);
        },
        show: (visible) => void (head.enabled = visible),
        attach: (attached) => void (attached ? group.addChild(head) : head.remove()),
        seen: () => [head.heightPx(camera.camera, SIZE), head.levelFor(camera.camera, SIZE)],
        pose: (said) => setPose(head, said),
        dispose: () => head.destroy(),
        lit: () => numbersOf(head.instance),
      };
    },
    wall(z) {
      plane.enabled = z !== null;
      plane.setPosition(-4, 0, z ?? 0);
    },
    pane(z) {
      pane.enabled = z !== null;
      pane.setPosition(0, 0, z ?? 0);
    },
    lamps(list) {
      for (const one of [...lamps.children]) one.destroy();
      const even = list.filter(({ kind }) => kind === "ambient");
      app.scene.ambientLight = new pc.Color(...[0, 1, 2].map((c) => even.reduce((sum, { colour, intensity }) => sum + colour[c] * intensity, 0) ** (1 / 2.2)));
      for (const one of list) if (one.kind !== "ambient") lamps.addChild(lampOf(one));
    },
    ball: (on) => void (ball.enabled = on),
    floor(z) {
      floor.enabled = true;
      floor.setPosition(0, 0, z);
    },
    part(x, y, size) {
      camera.camera.fov = (fovOf(size) * 180) / Math.PI;
      camera.camera.rect = new pc.Vec4(x / SIZE, y / SIZE, size / SIZE, size / SIZE);
    },
    draw: () => app.render(),
    finished: () => avatars.finished(),
    async read() {
      if (colorBuffer === null) return drawing.read();
      const bytes = await colorBuffer.read(0, 0, SIZE, SIZE, { immediate: true });
      return options.api === "webgpu" ? bytes : flipped(bytes);
    },
    orthographic: (on) => void (camera.camera.projection = on ? pc.PROJECTION_ORTHOGRAPHIC : pc.PROJECTION_PERSPECTIVE),
    disposeAvatars: () => avatars.destroy(),
  };
  avatars.on("change", () => (stage.newer = true));
  return stage;
}
