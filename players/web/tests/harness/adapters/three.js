import * as THREE from "three";
import { WebGPURenderer } from "three/webgpu";
import { AvatarScene } from "../../../src/three.ts";
import { QuietCanvas, watchErrors } from "./gpu.js";
import { BACKGROUND, FOV_Y, MAP, RADIUS, SIZE, WALL, clamped, flipped, fovOf, numbersOf, optionsOf, setPose, webGl } from "./stage.js";

const colour = ([r, g, b]) => new THREE.Color().setRGB(r / 255, g / 255, b / 255, THREE.SRGBColorSpace);
const display = (value) => new THREE.Color(value, 0, 0).convertLinearToSRGB().r;
/** Bytes of a target, which holds linear light. */
const shown = (floats) => Array.from(floats, (value, i) => Math.round(255 * (i % 4 === 3 ? value : display(value))));

/** A light of three.js; its target is in the scene. */
function lampOf({ kind, colour, intensity, casts = false, ...where }, scene) {
  const made = new THREE.Color(...colour);
  const light = {
    ambient: () => new THREE.AmbientLight(made, intensity),
    sky: () => new THREE.HemisphereLight(made, new THREE.Color(...where.ground), intensity),
    sun: () => new THREE.DirectionalLight(made, intensity),
    bulb: () => new THREE.PointLight(made, intensity, where.range),
    spot: () => new THREE.SpotLight(made, intensity, where.range, where.angle, 0.4),
  }[kind]();
  light.position.set(...(where.at ?? where.towards ?? [0, 1, 0]));
  if (light.target !== undefined) scene.add(light.target);
  light.castShadow = casts;
  if (casts) {
    light.shadow.mapSize.setScalar(MAP.texels);
    Object.assign(light.shadow.camera, { left: -MAP.radius, right: MAP.radius, bottom: -MAP.radius, top: MAP.radius, near: 0.1, far: MAP.far });
  }
  return light;
}

function byWebGl(options) {
  const renderer = new THREE.WebGLRenderer({ antialias: options.antialias, reversedDepthBuffer: options.reversed === true });
  const target = options.target ? new THREE.WebGLRenderTarget(SIZE, SIZE, { type: THREE.FloatType, samples: options.antialias ? 4 : 0 }) : null;
  const gl = webGl(renderer.getContext());
  const read = async () => {
    if (target === null) return gl.read();
    const floats = new Float32Array(4 * SIZE * SIZE);
    renderer.readRenderTargetPixels(target, 0, 0, SIZE, SIZE, floats);
    return flipped(shown(floats));
  };
  return { ...gl, renderer, target, read };
}

async function byWebGpu(options) {
  const canvas = new QuietCanvas();
  const forceWebGL = options.api === "webgl2";
  const renderer = new WebGPURenderer({ canvas: canvas.element, antialias: options.antialias, forceWebGL, reversedDepthBuffer: options.reversed === true });
  await renderer.init();
  const target = options.target ? new THREE.RenderTarget(SIZE, SIZE, { type: THREE.HalfFloatType, samples: options.antialias ? 4 : 0 }) : null;
  const read = async () => {
    if (target === null) return canvas.read();
    const halves = await renderer.readRenderTargetPixelsAsync(target, 0, 0, SIZE, SIZE);
    return (forceWebGL ? flipped : clamped)(shown(Array.from(halves, THREE.DataUtils.fromHalfFloat)));
  };
  return { renderer, target, read, lose: async () => undefined, errors: watchErrors(renderer.backend.device) };
}

export async function makeStage(options) {
  const { renderer, target, ...drawing } = options.fallback || options.api === "webgpu" ? await byWebGpu(options) : byWebGl(options);
  renderer.setSize(SIZE, SIZE);
  renderer.shadowMap.enabled = options.shadows === true;
  const scene = new THREE.Scene();
  scene.background = colour(BACKGROUND);
  const camera = new THREE.PerspectiveCamera((FOV_Y * 180) / Math.PI, 1, options.distance / 50, options.distance * 5);
  camera.position.z = options.distance;
  let seenBy = camera;
  const plane = new THREE.Mesh(new THREE.PlaneGeometry(8, 8), new THREE.MeshBasicMaterial({ color: colour(WALL) }));
  const ball = new THREE.Mesh(new THREE.SphereGeometry(RADIUS, 128, 64), new THREE.MeshLambertMaterial());
  const floor = new THREE.Mesh(new THREE.PlaneGeometry(8, 8), ball.material);
  floor.receiveShadow = true;
  ball.visible = floor.visible = false;
  const lamps = new THREE.Group();
  const group = new THREE.Group();
  const avatars = await AvatarScene.create(renderer, optionsOf(options));
  const pane = new THREE.Mesh(plane.geometry, plane.material.clone());
  pane.material.transparent = true;
  pane.renderOrder = avatars.renderOrder + 1;
  const later = renderer.isWebGPURenderer ? new THREE.Scene() : scene; // there avatars end a pass
  scene.add(plane, ball, floor, lamps, group, avatars);
  const actorOf = (head) => ({
    place(x, y, z, yaw, scale) {
      head.position.set(x, y, z);
      head.rotation.y = yaw;
      head.scale.setScalar(scale);
    },
    show: (visible) => void (head.visible = visible),
    attach: (attached) => void (attached ? group.add(head) : head.removeFromParent()),
    seen: () => [head.heightPx(camera, SIZE), head.levelFor(camera, SIZE)],
    pose: (said) => setPose(head, said),
    dispose: () => head.dispose(),
    lit: () => numbersOf(head.instance),
    clone() {
      const other = head.clone();
      group.add(other);
      return actorOf(other);
    },
  });
  const stage = {
    ...drawing,
    newer: false,
    add: (avatar, level = 0) => actorOf(avatars.addAvatar(avatar, { level })),
    wall(z) {
      plane.visible = z !== null;
      plane.position.set(-4, 0, z ?? 0);
    },
    pane(z) {
      if (z === null) pane.removeFromParent();
      else later.add(pane);
      pane.position.z = z;
    },
    lamps(list) {
      lamps.clear();
      for (const one of list) lamps.add(lampOf(one, scene));
    },
    ball: (on) => void (ball.visible = on),
    floor(z) {
      floor.visible = true;
      floor.position.z = z;
    },
    part(x, y, size) {
      camera.fov = (fovOf(size) * 180) / Math.PI;
      camera.updateProjectionMatrix();
      const rows = renderer.isWebGPURenderer ? SIZE - y - size : y; // WebGPURenderer counts from the top
      if (target === null) renderer.setViewport(x, rows, size, size);
      else target.viewport.set(x, rows, size, size);
    },
    draw() {
      renderer.setRenderTarget(target);
      renderer.render(scene, seenBy);
      if (later === scene || pane.parent === null) return;
      renderer.autoClear = false;
      renderer.render(later, seenBy);
      renderer.autoClear = true;
    },
    finished: () => avatars.finished(),
    orthographic: (on) => void (seenBy = on ? new THREE.OrthographicCamera(-1, 1, 1, -1, -1, 1) : camera),
    disposeAvatars: () => avatars.dispose(),
  };
  avatars.addEventListener("change", () => (stage.newer = true));
  return stage;
}
