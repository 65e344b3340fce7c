// PlayCanvas: still Gaussians of a PLY, a camera that moves.
import * as pc from "playcanvas";
import { eyeOf, makeCanvas, offer, steppedAnimation } from "./common.ts";

const animation = steppedAnimation();

offer(async (setup) => {
  const canvas = makeCanvas(setup.size);
  const device = await pc.createGraphicsDevice(canvas, { deviceTypes: ["webgl2"], antialias: false });
  device.maxPixelRatio = 1;
  const options = new pc.AppOptions();
  options.graphicsDevice = device;
  options.componentSystems = [pc.CameraComponentSystem, pc.GSplatComponentSystem];
  options.resourceHandlers = [pc.GSplatHandler];
  const app = new pc.AppBase(canvas);
  app.init(options);
  app.start();
  const asset = new pc.Asset("avatar", "gsplat", { url: setup.url, filename: "avatar.ply" });
  app.assets.add(asset);
  const loaded = new Promise((done, fail) => {
    asset.once("load", done);
    asset.once("error", fail);
  });
  app.assets.load(asset);
  await loaded;
  const [entity, camera] = [new pc.Entity(), new pc.Entity()];
  entity.addComponent("gsplat", { asset });
  camera.addComponent("camera", { clearColor: new pc.Color(1, 1, 1), fov: (setup.fovY * 180) / Math.PI, nearClip: 0.01, farClip: 100 });
  for (const one of [entity, camera]) app.root.addChild(one);
  return {
    gl: device.gl,
    draw(i) {
      camera.setPosition(...eyeOf(setup, i));
      camera.lookAt(...setup.target);
      animation.run(i * 33);
    },
  };
});
