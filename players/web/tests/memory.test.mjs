// What frames allocate and what loading leaves behind: node --test tests/memory.test.mjs. LONG=1 adds WebGPU, which is slow in software.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { bundle } from "../bundle.mjs";
import { allocated, liveBytes } from "./allocation.mjs";
import { openHarness } from "./pages.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
const LONG = process.env.LONG === "1";
const FRAMES = { webgl2: 1000, webgpu: 1000 };
const WARM = { webgl2: 2000, webgpu: 800 };
const LOADS = 50;
const PACK = "joints";
// The smallest object has 12 bytes: a function that made one a frame, or kept one a frame, would reach this over 1,000
// frames. V8's own tables (feedback, compiled code, the inspector's session) move by some hundred bytes to 4 kB.
const FLAT = 12_000;
// Of an avatar that stays, the names, tables and closures alone are more than this.
const BYTES_A_LOAD = 4_000;
// These functions receive what the browser makes of a message, or make the promise that their caller asked for.
const OF_CALLER = /onmessage|finished/;

let harness;

before(async () => (harness = await openHarness("memory", [PACK])));
after(() => harness?.close());

async function started(backend) {
  const { page, errors } = await harness.again();
  await page.evaluate((b, file) => window.start(b, file), backend, `${PACK}.avatar`);
  const frames = (n = FRAMES[backend]) => page.evaluate((count) => window.frames(count), n);
  await frames(WARM[backend]); // until V8 has compiled what it will
  const clients = [await page.createCDPSession(), ...page.workers().map((worker) => worker.client)];
  const live = async () => {
    let sum = 0;
    for (const client of clients) sum += await liveBytes(client);
    return sum;
  };
  return { page, errors, frames, clients, live };
}

for (const backend of LONG ? ["webgl2", "webgpu"] : ["webgl2"]) {
  test(`${backend}: frames keep nothing, loads leave nothing`, { timeout: 240_000 }, async (t) => {
    const { page, errors, frames, clients, live } = await started(backend);
    const before = await live();
    const objects = await frames();
    const grown = (await live()) - before;
    t.diagnostic(`${FRAMES[backend]} frames of 64x64: heap ${before} bytes, grown by ${grown}`);
    assert.ok(grown < FLAT, `the heap grew by ${grown} bytes`);

    if (backend === "webgl2") {
      const found = Object.entries(await allocated(clients[0], harness.script, frames));
      const ours = found.filter(([name, bytes]) => name.startsWith("src/") && !OF_CALLER.test(name) && bytes >= FLAT);
      assert.ok(found.some(([name]) => name.startsWith("src/") && OF_CALLER.test(name)), "the sampler sees files of src/");
      assert.deepEqual(ours, [], "bytes by function");
      t.diagnostic(`bytes of 1,000 frames by functions of the page: ${JSON.stringify(found.filter(([name]) => name.startsWith("src/")))}`);
      const worker = Object.entries(await allocated(clients[1], "", frames)).filter(([name]) => !/ (\(.*\)|.*onmessage):/.test(name));
      t.diagnostic(`bytes of 1,000 frames by the worker's functions: ${JSON.stringify(worker)}`);
      assert.ok(worker.reduce((sum, [, bytes]) => sum + bytes, 0) < FLAT, JSON.stringify(worker));
    }

    const load = (n) => page.evaluate((file, count) => window.loads(file, count), `${PACK}.avatar`, n);
    await load(LOADS / 2); // fills the browser's own caches
    const settled = await live();
    assert.deepEqual(await load(LOADS), objects, "GPU objects");
    const left = (await live()) - settled;
    t.diagnostic(`${LOADS} loads and disposals: heap grown by ${left} bytes`);
    assert.ok(left < LOADS * BYTES_A_LOAD, `the heap grew by ${left} bytes`);

    const end = await page.evaluate(() => window.dispose());
    assert.ok(Object.values(end).every((count) => count === 0), JSON.stringify(end));
    assert.deepEqual(errors, []);
    await page.close();
  });
}

test("the kernels' memory is free again", async () => {
  const text = `
    export { load } from "./load.ts"; export { KernelScene, kernelProgram } from "./webgl2/kernel_scene.ts";
    export { KERNELS } from "./made/kernels.ts"; export { bytesOfBase64 } from "./webgl2/base64.ts";`;
  const stdin = { contents: text, resolveDir: join(HERE, "../src"), loader: "ts" };
  const { outputFiles } = await bundle({ stdin, write: false, platform: "neutral" });
  const made = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);
  const pack = await readFile(join(HERE, `../../../tests/data/packs/1.0/${PACK}.avatar`));
  const instance = new WebAssembly.Instance(new WebAssembly.Module(made.bytesOfBase64(made.KERNELS)));
  const scene = new made.KernelScene(instance);
  scene.choose([]);
  const [used, bytes] = [scene.heap.bytesUsed, []];
  for (let i = 0; i < LOADS; i++) {
    const avatar = await made.load(new Uint8Array(pack));
    scene.add(1, made.kernelProgram(avatar, avatar.program.levels[0], avatar.program.readsMesh));
    scene.choose([1]);
    bytes.push(instance.exports.memory.buffer.byteLength);
    scene.remove(1);
    assert.equal(scene.heap.bytesUsed, used);
  }
  assert.equal(bytes.at(-1), bytes[0]);
});
