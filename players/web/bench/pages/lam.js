// LAM's own renderer: its avatar with every weight and the camera changed in every frame.
import { GaussianSplatRenderer } from "gaussian-splat-renderer-for-lam";
import { eyeOf, offer, steppedAnimation } from "./common.ts";

const FADE_IN_MS = 15_000; // it shows the avatar little by little
const animation = steppedAnimation();

offer(async (setup) => {
  const weights = {};
  const box = document.createElement("div");
  box.style.cssText = `width:${setup.size}px;height:${setup.size}px`;
  document.body.append(box);
  let loaded;
  const done = new Promise((resolve) => (loaded = resolve));
  const renderer = await GaussianSplatRenderer.getInstance(box, setup.url, {
    getChatState: () => "Idle",
    getExpressionData: () => weights,
    backgroundColor: "0xffffff",
    loadProgress: (part) => part === 1 && loaded(),
  });
  await done;
  const { viewer } = renderer;
  const names = Object.keys(renderer.updateBS(null));
  return {
    gl: viewer.renderer.getContext(),
    draw(i) {
      names.forEach((name, k) => (weights[name] = 0.1 + 0.1 * Math.sin(0.2 * i + k)));
      if (viewer.controls) viewer.controls.enabled = false;
      viewer.camera.fov = (setup.fovY * 180) / Math.PI;
      viewer.camera.updateProjectionMatrix();
      viewer.controls?.target.set(...setup.target);
      viewer.camera.position.set(...eyeOf(setup, i));
      viewer.camera.lookAt(...setup.target);
      viewer.forceRenderNextFrame?.();
      animation.run(i * 33);
    },
  };
}, FADE_IN_MS);
