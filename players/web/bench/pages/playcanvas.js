// PlayCanvas: still Gaussians of a PLY, a camera that moves.
import * as pc from "playcanvas";
import { coverage, eyeOf, finish, makeCanvas, offer, pause, steppedAnimation } from "./common.ts";

const animation = steppedAnimation();
let app, camera, setup, gl;

offer({
  async start(given) {
    setup = given;
    const canvas = makeCanvas(setup.size);
    const device = await pc.createGraphicsDevice(canvas, { deviceTypes: ["webgl2"], antialias: false });
    device.maxPixelRatio = 1;
    gl = device.gl;
    const options = new pc.AppOptions();
    options.graphicsDevice = device;
    options.componentSystems = [pc.CameraComponentSystem, pc.GSplatComponentSystem];
    options.resourceHandlers = [pc.GSplatHandler];
    app = new pc.AppBase(canvas);
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
    const entity = new pc.Entity();
    entity.addComponent("gsplat", { asset });
    app.root.addChild(entity);
    camera = new pc.Entity();
    camera.addComponent("camera", { clearColor: new pc.Color(1, 1, 1), fov: (setup.fovY * 180) / Math.PI, nearClip: 0.01, farClip: 100 });
    app.root.addChild(camera);
    for (let i = 0; i < 8; i++) {
      draw(i);
      await pause(100);
    }
  },
  async step(i) {
    draw(i);
    finish(gl);
    await pause();
  },
  async covered() {
    draw(0);
    await pause(1000);
    draw(0);
    return coverage(gl);
  },
});

function draw(i) {
  camera.setPosition(...eyeOf(setup, i));
  camera.lookAt(...setup.target);
  animation.run(i * 33);
}
