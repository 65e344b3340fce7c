// What runs in the page of memory.test.mjs and unchanged.test.mjs.

import { Camera } from "../../src/camera.js";
import { load } from "../../src/load.js";
import { Player } from "../../src/player.js";
import type { Instance } from "../../src/instance.js";

type Backend = "webgpu" | "webgl2";
/** GPU objects that were made and not freed, by the name of the call that makes them. */
const alive: Record<string, number> = {};
const camera = new Camera();
let player: Player;
let instance: Instance;

/** Counts what `make` makes until `free` is called for it. */
function count(prototype: object, make: string, freeOf: object, free: string): void {
  const [makers, freers] = [prototype as Record<string, (...args: unknown[]) => unknown>, freeOf as Record<string, (...args: unknown[]) => unknown>];
  const [made, freed] = [makers[make]!, freers[free]!];
  alive[make] = 0;
  const seen = new WeakSet<object>();
  makers[make] = function (...args) {
    const one = made.apply(this, args) as object;
    seen.add(one);
    alive[make]!++;
    return one;
  };
  freers[free] = function (...args) {
    const one = (args[0] ?? this) as object; // gl.deleteBuffer(buffer), buffer.destroy()
    if (seen.delete(one)) alive[make]!--;
    return freed.apply(this, args);
  };
}

function countObjects(backend: Backend): void {
  if (backend === "webgl2") {
    const gl = WebGL2RenderingContext.prototype;
    for (const kind of ["Buffer", "Texture", "Framebuffer", "VertexArray", "Program"]) count(gl, `create${kind}`, gl, `delete${kind}`);
  } else {
    count(GPUDevice.prototype, "createBuffer", GPUBuffer.prototype, "destroy");
    count(GPUDevice.prototype, "createTexture", GPUTexture.prototype, "destroy");
  }
}

async function start(backend: Backend, file: string): Promise<void> {
  countObjects(backend);
  player = await Player.create(null, { backend });
  instance = player.add(await load(file));
}

function aim(i: number, size: number): void {
  const { target, size: extent } = instance.avatar.framing.whole;
  camera.orbit(target, 1.5 * Math.max(extent[0], extent[1], extent[2]), 0.5 * Math.sin(i), 0, 0.8, size, size);
}

function pose(i: number): void {
  const { expressionWeights, jointDelta } = instance.pose;
  for (let k = 0; k < expressionWeights.length; k++) expressionWeights[k] = 0.3 * Math.sin(0.1 * i + k);
  if (jointDelta.length > 0) jointDelta[3] = 0.01 * Math.sin(0.1 * i);
}

/** `n` frames of size 64 with a new pose and camera each; returns how many GPU objects live. */
async function frames(n: number): Promise<Record<string, number>> {
  for (let i = 0; i < n; i++) {
    pose(i);
    aim(i, 64);
    player.frame(camera, null);
    await player.finished();
  }
  return { ...alive };
}

/** Loads, draws and disposes of `n` avatars; returns how many GPU objects live. */
async function loads(file: string, n: number): Promise<Record<string, number>> {
  for (let i = 0; i < n; i++) {
    const other = player.add(await load(file));
    player.frame(camera, null);
    await player.finished();
    other.dispose();
  }
  return frames(1);
}

/** Frees the player; returns how many GPU objects live. */
function dispose(): Record<string, number> {
  player.dispose();
  return { ...alive };
}

/** The image of a pose and a camera after frames of others: [pose, camera] by number. */
async function image(steps: readonly (readonly [number, number])[], size: number): Promise<string> {
  for (const [ofPose, ofCamera] of steps) {
    pose(ofPose);
    aim(ofCamera, size);
    player.frame(camera, null);
    await player.finished();
  }
  return Array.from(await player.readPixels(), (value) => value.toString(16)).join(" ");
}

Object.assign(window, { start, frames, loads, dispose, image });
