// gsplat.js: still Gaussians of a PLY, a camera that moves.
import * as SPLAT from "gsplat";
import { eyeOf, makeCanvas, offer, yawOf } from "./common.ts";

offer(async (setup) => {
  const canvas = makeCanvas(setup.size);
  const renderer = new SPLAT.WebGLRenderer(canvas);
  renderer.backgroundColor = new SPLAT.Color32(255, 255, 255, 255);
  const scene = new SPLAT.Scene();
  const camera = new SPLAT.Camera();
  await SPLAT.PLYLoader.LoadAsync(setup.url, scene);
  renderer.setSize(setup.size, setup.size);
  camera.data.fx = camera.data.fy = setup.size / (2 * Math.tan(setup.fovY / 2));
  return {
    gl: canvas.getContext("webgl2"),
    draw(i) {
      const half = yawOf(i) / 2;
      camera.position = new SPLAT.Vector3(...eyeOf(setup, i));
      camera.rotation = new SPLAT.Quaternion(Math.cos(half), 0, -Math.sin(half), 0); // its camera looks along +z, y down
      renderer.render(scene, camera);
    },
  };
});
