// Spark: still Gaussians of a PLY, a camera that moves.
import * as THREE from "three";
import { SparkRenderer, SplatMesh } from "@sparkjsdev/spark";
import { coverage, eyeOf, finish, makeCanvas, offer, pause } from "./common.ts";

let renderer, scene, camera, setup;

offer({
  async start(given) {
    setup = given;
    renderer = new THREE.WebGLRenderer({ canvas: makeCanvas(setup.size), antialias: false });
    renderer.setPixelRatio(1);
    renderer.setSize(setup.size, setup.size);
    renderer.setClearColor(0xffffff);
    scene = new THREE.Scene();
    camera = new THREE.PerspectiveCamera((setup.fovY * 180) / Math.PI, 1, 0.01, 100);
    scene.add(new SparkRenderer({ renderer, minAlpha: 1 / 255 }));
    const mesh = new SplatMesh({ url: setup.url, lod: false });
    scene.add(mesh);
    await mesh.initialized;
    for (let i = 0; i < 8; i++) {
      draw(i);
      await pause(100);
    }
  },
  async step(i) {
    draw(i);
    finish(renderer.getContext());
    await pause();
  },
  async covered() {
    draw(0);
    await pause(1000);
    draw(0);
    return coverage(renderer.getContext());
  },
});

function draw(i) {
  camera.position.set(...eyeOf(setup, i));
  camera.lookAt(...setup.target);
  renderer.render(scene, camera);
}
