// The scene of WebAssembly kernels without a browser: node --test tests/kernels.test.mjs.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { test } from "node:test";
import { imported } from "../bundle.mjs";
import { HERE, PACKS } from "./browser.mjs";

const PARTS = `
  export { load } from "./load.ts"; export { KernelScene, kernelProgram } from "./webgl2/kernel_scene.ts";
  export { Camera } from "./camera.ts"; export { Instance } from "./instance.ts";
  export { kernelModule } from "./webgl2/kernel_module.ts";`;
const LOADS = 50;
const ID = 1;

const stdin = { contents: PARTS, resolveDir: join(HERE, "../src"), loader: "ts" };
const made = await imported({ stdin });
const module = await made.kernelModule();

const pack = async (name) => new Uint8Array(await readFile(join(PACKS, `${name}.avatar`)));

/** A scene of one avatar. `frame(weight)` poses all expressions and returns what the scene made of them. */
async function scene(name) {
  const avatar = await made.load(await pack(name));
  const instance = new made.Instance(avatar, { changed() {}, remove() {} }, 0);
  const camera = new made.Camera();
  camera.orbit(avatar.framing.whole.target, 0.6, 0.2, 0.1, 0.7, 64, 64);
  const scene = new made.KernelScene(new WebAssembly.Instance(module));
  const kernels = scene.add(ID, made.kernelProgram(avatar, instance.program, avatar.program.readsMesh));
  scene.choose([ID]);
  const frame = (weight) => {
    instance.pose.expressionWeights.fill(weight);
    instance.update(camera);
    const count = scene.run(Float32Array.of(...instance.poseFloats, ...instance.values.floats));
    return scene.quadFloats.slice(0, 12 * count);
  };
  const first = kernels.address(`${instance.program.prefix}Sh.0`) / 4;
  return { frame, sh: () => scene.heap.f32.subarray(first, first + 48) };
}

for (const [name, changing] of [["joints", true], ["surface", false]]) {
  test(`${name}: SH are computed again ${changing ? "for each pose" : "for no pose"}, and pictures are the same`, async () => {
    const one = await scene(name);
    one.frame(0.2);
    const second = one.frame(0.7);
    assert.deepEqual(second, (await scene(name)).frame(0.7));
    assert.notDeepEqual(second, one.frame(0.2));
    one.sh().fill(0.5);
    one.frame(0.7);
    assert.equal(one.sh().every((value) => value === 0.5), !changing);
  });
}

test("the kernels' memory is free again", async () => {
  const instance = new WebAssembly.Instance(module);
  const scene = new made.KernelScene(instance);
  scene.choose([]);
  const [used, bytes, joints] = [scene.heap.bytesUsed, [], await pack("joints")];
  for (let i = 0; i < LOADS; i++) {
    const avatar = await made.load(joints);
    scene.add(ID, made.kernelProgram(avatar, avatar.program.levels[0], avatar.program.readsMesh));
    scene.choose([ID]);
    bytes.push(instance.exports.memory.buffer.byteLength);
    scene.remove(ID);
    assert.equal(scene.heap.bytesUsed, used);
  }
  assert.equal(bytes.at(-1), bytes[0]);
});
