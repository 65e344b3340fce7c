// Spark: still Gaussians of a PLY, a camera that moves.
import * as THREE from "three";
import { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";
import { eyeOf, makeCanvas, offer } from "./common.ts";

offer(async (setup) => {
  const renderer = new THREE.WebGLRenderer({ canvas: makeCanvas(setup.size), antialias: false });
  renderer.setPixelRatio(1);
  renderer.setSize(setup.size, setup.size);
  renderer.setClearColor(0xffffff);
  const scene = new THREE.Scene();
  const camera = new THREE.PerspectiveCamera((setup.fovY * 180) / Math.PI, 1, 0.01, 100);
  const mesh = new SplatMesh({ url: setup.url, lod: false });
  scene.add(new SparkRenderer({ renderer, minAlpha: 1 / 255 }), mesh);
  await mesh.initialized;
  return {
    gl: renderer.getContext(),
    draw(i) {
      camera.position.set(...eyeOf(setup, i));
      camera.lookAt(...setup.target);
      renderer.render(scene, camera);
    },
  };
});
