// LAM's own renderer: its avatar with every weight and the camera changed in every frame.
import { GaussianSplatRenderer } from "gaussian-splat-renderer-for-lam";
import { coverage, eyeOf, finish, offer, pause, steppedAnimation } from "./common.ts";

const FADE_IN_S = 15; // it shows the avatar little by little
const animation = steppedAnimation();
const weights = {};
let renderer, setup, gl, names;

offer({
  async start(given) {
    setup = given;
    const box = document.createElement("div");
    box.style.cssText = `width:${setup.size}px;height:${setup.size}px`;
    document.body.append(box);
    let loaded;
    const done = new Promise((resolve) => (loaded = resolve));
    renderer = await GaussianSplatRenderer.getInstance(box, setup.url, {
      getChatState: () => "Idle",
      getExpressionData: () => weights,
      backgroundColor: "0xffffff",
      loadProgress: (part) => part === 1 && loaded(),
    });
    await done;
    gl = renderer.viewer.renderer.getContext();
    names = Object.keys(renderer.updateBS(null));
    const end = performance.now() + 1000 * FADE_IN_S;
    for (let i = 0; performance.now() < end; i++) {
      draw(i);
      await pause(50);
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
  names.forEach((name, k) => (weights[name] = 0.1 + 0.1 * Math.sin(0.2 * i + k)));
  const { viewer } = renderer;
  if (viewer.controls) viewer.controls.enabled = false;
  viewer.camera.fov = (setup.fovY * 180) / Math.PI;
  viewer.camera.updateProjectionMatrix();
  viewer.controls?.target.set(...setup.target);
  viewer.camera.position.set(...eyeOf(setup, i));
  viewer.camera.lookAt(...setup.target);
  viewer.forceRenderNextFrame?.();
  animation.run(i * 33);
}
