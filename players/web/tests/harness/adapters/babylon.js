import { Engine } from "@babylonjs/core/Engines/engine.js";
import { WebGPUEngine } from "@babylonjs/core/Engines/webgpuEngine.js";
import { FreeCamera } from "@babylonjs/core/Cameras/freeCamera.js";
import { DirectionalLight } from "@babylonjs/core/Lights/directionalLight.js";
import { HemisphericLight } from "@babylonjs/core/Lights/hemisphericLight.js";
import { PointLight } from "@babylonjs/core/Lights/pointLight.js";
import { ShadowGenerator } from "@babylonjs/core/Lights/Shadows/shadowGenerator.js";
import { SpotLight } from "@babylonjs/core/Lights/spotLight.js";
import { PBRMaterial } from "@babylonjs/core/Materials/PBR/pbrMaterial.js";
import { StandardMaterial } from "@babylonjs/core/Materials/standardMaterial.js";
import { RenderTargetTexture } from "@babylonjs/core/Materials/Textures/renderTargetTexture.js";
import { Color3, Color4 } from "@babylonjs/core/Maths/math.color.js";
import { Viewport } from "@babylonjs/core/Maths/math.viewport.js";
import { Vector3 } from "@babylonjs/core/Maths/math.vector.js";
import { CreatePlane } from "@babylonjs/core/Meshes/Builders/planeBuilder.js";
import { CreateSphere } from "@babylonjs/core/Meshes/Builders/sphereBuilder.js";
import { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import { Scene } from "@babylonjs/core/scene.js";
import { AvatarScene } from "../../../src/babylon.ts";
import { QuietCanvas, watchErrors } from "./gpu.js";
import { BACKGROUND, FOV_Y, MAP, RADIUS, SIZE, WALL, flipped, fovOf, makeCanvas, numbersOf, optionsOf, setPose, webGl } from "./stage.js";

const colour = ([r, g, b]) => new Color3(r / 255, g / 255, b / 255);

/** A light; `heads`: what casts. */
function lampOf({ kind, colour, intensity, casts = false, ...where }, scene, heads) {
  const vector = (values, sign = 1) => new Vector3(...values.map((value) => sign * value));
  const light = {
    ambient: () => new HemisphericLight("", new Vector3(0, 1, 0), scene),
    sky: () => new HemisphericLight("", new Vector3(0, 2, 0), scene),
    sun: () => new DirectionalLight("", vector(where.towards, -1), scene),
    bulb: () => new PointLight("", vector(where.at), scene),
    spot: () => new SpotLight("", vector(where.at), vector(where.at, -1), 2 * where.angle, 1, scene),
  }[kind]();
  light.diffuse = new Color3(...colour);
  light.intensity = intensity;
  if (kind === "ambient" || kind === "sky") light.groundColor = new Color3(...(where.ground ?? colour));
  if (!casts) return;
  light.position = vector(where.towards);
  light.shadowMinZ = 0.1;
  light.shadowMaxZ = MAP.far;
  const shadows = new ShadowGenerator(MAP.texels, light);
  for (const { shadowCaster } of heads) if (shadowCaster !== null) shadows.addShadowCaster(shadowCaster);
}

function byWebGl({ antialias }) {
  const canvas = makeCanvas();
  const engine = new Engine(canvas, antialias, { useExactSrgbConversions: true }, false);
  return { engine, ...webGl(canvas.getContext("webgl2")) };
}

async function byWebGpu({ antialias }) {
  const canvas = new QuietCanvas();
  const engine = new WebGPUEngine(canvas.element, { antialias, useExactSrgbConversions: true });
  const noFiles = { jsPath: "/none.js", wasmPath: "/none.wasm" }; // its shaders for the plane exist as WGSL
  await engine.initAsync(noFiles, noFiles);
  return { engine, errors: watchErrors(engine._device), lose: async () => undefined, read: () => canvas.read() };
}

/** A scene over another one, that keeps its depth: with a plane over the whole view. */
async function laterScene(engine, before, { position, fov, minZ, maxZ, outputRenderTarget }, z) {
  const scene = new Scene(engine);
  scene.useRightHandedSystem = before.useRightHandedSystem;
  scene.autoClear = scene.autoClearDepthAndStencil = false;
  const camera = Object.assign(new FreeCamera("later", position.clone(), scene), { fov, minZ, maxZ, outputRenderTarget });
  camera.setTarget(Vector3.Zero());
  const plane = CreatePlane("pane", { size: 8, sideOrientation: 2 }, scene);
  plane.position.z = z;
  plane.material = Object.assign(new StandardMaterial("pane", scene), { disableLighting: true, emissiveColor: colour(WALL), alpha: 0.999 });
  await scene.whenReadyAsync();
  return scene;
}

/** The scene of any engine. Right-handed, it equals those of the other engines. */
export async function makeStage(options) {
  const { engine, ...drawing } = options.api === "webgpu" ? await byWebGpu(options) : byWebGl(options);
  const scene = new Scene(engine);
  scene.useRightHandedSystem = options.leftHanded !== true;
  scene.clearColor = Color4.FromColor3(colour(BACKGROUND), 1);
  const camera = new FreeCamera("camera", new Vector3(0, 0, options.distance), scene);
  camera.setTarget(Vector3.Zero());
  camera.fov = FOV_Y;
  camera.minZ = options.distance / 50;
  camera.maxZ = options.distance * 5;
  const target = options.target ? new RenderTargetTexture("target", SIZE, scene, { generateMipMaps: false }) : null;
  if (target !== null) {
    target.samples = options.antialias ? 4 : 1;
    target.clearColor = scene.clearColor;
    camera.outputRenderTarget = target;
  }
  const plane = CreatePlane("wall", { size: 8, sideOrientation: 2 }, scene);
  const material = new StandardMaterial("wall", scene);
  material.disableLighting = true;
  material.emissiveColor = colour(WALL);
  plane.material = material;
  const ball = CreateSphere("ball", { diameter: 2 * RADIUS, segments: 64 }, scene);
  ball.material = Object.assign(new PBRMaterial("ball", scene), { metallic: 0, roughness: 1, metallicF0Factor: 0, maxSimultaneousLights: 8 });
  const floor = CreatePlane("floor", { size: 8, sideOrientation: 2 }, scene);
  floor.material = ball.material;
  floor.receiveShadows = true;
  ball.setEnabled(false);
  floor.setEnabled(false);
  const group = new TransformNode("group", scene);
  const avatars = await AvatarScene.create(scene, optionsOf(options));
  const heads = [];
  let pane = null;
  await scene.whenReadyAsync();
  const stage = {
    ...drawing,
    newer: false,
    add(avatar, level = 0) {
      const head = avatars.addAvatar(avatar, { level });
      heads.push(head);
      return {
        place(x, y, z, yaw, scale) {
          head.position.set(x, y, z);
          head.rotation.y = yaw;
          head.scaling.setAll(scale);
        },
        show: (visible) => head.setEnabled(visible),
        attach(attached) {
          if (attached) scene.addTransformNode(head);
          else scene.removeTransformNode(head);
          head.parent = attached ? group : null;
        },
        seen: () => [head.heightPx(camera, SIZE), head.levelFor(camera, SIZE)],
        pose: (said) => setPose(head, said),
        dispose() {
          heads.splice(heads.indexOf(head), 1);
          head.dispose();
        },
        lit: () => numbersOf(head.instance),
      };
    },
    wall(z) {
      plane.setEnabled(z !== null);
      plane.position.set(-4, 0, z ?? 0);
    },
    async pane(z) {
      pane?.dispose();
      pane = z === null ? null : await laterScene(engine, scene, camera, z);
    },
    lamps(list) {
      for (const light of [...scene.lights]) light.dispose();
      for (const one of list) lampOf(one, scene, heads);
    },
    async ball(on) {
      ball.setEnabled(on);
      await scene.whenReadyAsync();
    },
    async floor(z) {
      floor.position.z = z;
      floor.setEnabled(true);
      await scene.whenReadyAsync();
    },
    part(x, y, size) {
      camera.fov = fovOf(size);
      camera.viewport = new Viewport(x / SIZE, y / SIZE, size / SIZE, size / SIZE);
    },
    draw() {
      engine.beginFrame();
      scene.render();
      pane?.render();
      engine.endFrame();
    },
    finished: () => avatars.finished(),
    async read() {
      return target === null ? drawing.read() : flipped(new Uint8Array((await target.readPixels()).buffer));
    },
    async errors() {
      const drawn = heads.filter(({ shadowCaster }) => shadowCaster !== null && scene.getActiveMeshes().contains(shadowCaster));
      return [...(await drawing.errors()), ...drawn.map(() => "a mesh that casts a shadow is drawn")];
    },
    orthographic: (on) => void (camera.mode = on ? FreeCamera.ORTHOGRAPHIC_CAMERA : FreeCamera.PERSPECTIVE_CAMERA),
    disposeAvatars: () => avatars.dispose(),
  };
  avatars.onChangeObservable.add(() => (stage.newer = true));
  return stage;
}
