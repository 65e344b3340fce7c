// mkkellogg's GaussianSplats3D: still Gaussians of a PLY, a camera that moves.
import * as THREE from "three";
import * as GS from "@mkkellogg/gaussian-splats-3d";
import { eyeOf, makeCanvas, offer } from "./common.ts";

offer(async (setup) => {
  const renderer = new THREE.WebGLRenderer({ canvas: makeCanvas(setup.size), antialias: false });
  renderer.setPixelRatio(1);
  renderer.setSize(setup.size, setup.size);
  renderer.setClearColor(0xffffff);
  const camera = new THREE.PerspectiveCamera((setup.fovY * 180) / Math.PI, 1, 0.01, 100);
  const viewer = new GS.Viewer({
    renderer,
    camera,
    selfDrivenMode: false,
    useBuiltInControls: false,
    sharedMemoryForWorkers: false, // the page is not isolated
    sphericalHarmonicsDegree: 3,
  });
  await viewer.addSplatScene(setup.url, { showLoadingUI: false, splatAlphaRemovalThreshold: 0, format: GS.SceneFormat.Ply });
  return {
    gl: renderer.getContext(),
    draw(i) {
      camera.position.set(...eyeOf(setup, i));
      camera.lookAt(...setup.target);
      viewer.update();
      viewer.render();
    },
  };
});
