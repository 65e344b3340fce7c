// What frames allocate and what loading leaves behind: node --test tests/memory.test.mjs. LONG=1 adds WebGPU, which is slow in software.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { allocated, liveBytes } from "./allocation.mjs";
import { openHarness } from "./pages.mjs";

const LONG = process.env.LONG === "1";
const FRAMES = { webgl2: 1000, webgpu: 1000 };
const WARM = { webgl2: 2000, webgpu: 800 };
const LOADS = 50;
const PACK = "joints";
// The smallest object has 12 bytes: a function that made one a frame, or kept one a frame, would reach this over 1,000
// frames. V8's own tables (feedback, compiled code, the inspector's session) move by some hundred bytes to 4 kB.
const FLAT = 12_000;
// V8 compiles when it finds the time, on a busy machine in the middle of a measurement. What frames allocate comes with
// every thousand of them, so that the least of some trials counts.
const TRIALS = 3;
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

/** The least number of bytes of some trials; the first below `limit` ends them. */
async function least(limit, measure) {
  let bytes = Infinity;
  for (let trial = 0; trial < TRIALS && bytes >= limit; trial++) bytes = Math.min(bytes, await measure());
  return bytes;
}

for (const backend of LONG ? ["webgl2", "webgpu"] : ["webgl2"]) {
  test(`${backend}: frames keep nothing, loads leave nothing`, { timeout: 240_000 }, async (t) => {
    const { page, errors, frames, clients, live } = await started(backend);
    let objects;
    const grown = await least(FLAT, async () => {
      const before = await live();
      objects = await frames();
      return (await live()) - before;
    });
    t.diagnostic(`${FRAMES[backend]} frames of 64x64: heap grown by ${grown} bytes`);
    assert.ok(grown < FLAT, `the heap grew by ${grown} bytes`);

    if (backend === "webgl2") {
      let found, worker;
      const ours = await least(FLAT, async () => {
        found = Object.entries(await allocated(clients[0], harness.script, frames)).filter(([name]) => name.startsWith("src/"));
        return Math.max(0, ...found.filter(([name]) => !OF_CALLER.test(name)).map(([, bytes]) => bytes));
      });
      t.diagnostic(`bytes of 1,000 frames by functions of the page: ${JSON.stringify(found)}`);
      assert.ok(found.some(([name]) => OF_CALLER.test(name)), "the sampler sees files of src/");
      assert.ok(ours < FLAT, `a function of the page allocates ${ours} bytes`);
      const workers = await least(FLAT, async () => {
        worker = Object.entries(await allocated(clients[1], "", frames)).filter(([name]) => !/ (\(.*\)|.*onmessage):/.test(name));
        return worker.reduce((sum, [, bytes]) => sum + bytes, 0);
      });
      t.diagnostic(`bytes of 1,000 frames by the worker's functions: ${JSON.stringify(worker)}`);
      assert.ok(workers < FLAT, `the worker's functions allocate ${workers} bytes`);
    }

    const load = (n) => page.evaluate((file, count) => window.loads(file, count), `${PACK}.avatar`, n);
    await load(LOADS / 2); // fills the browser's own caches
    const left = await least(LOADS * BYTES_A_LOAD, async () => {
      const settled = await live();
      assert.deepEqual(await load(LOADS), objects, "GPU objects");
      return (await live()) - settled;
    });
    t.diagnostic(`${LOADS} loads and disposals: heap grown by ${left} bytes`);
    assert.ok(left < LOADS * BYTES_A_LOAD, `the heap grew by ${left} bytes`);

    const end = await page.evaluate(() => window.dispose());
    assert.ok(Object.values(end).every((count) => count === 0), JSON.stringify(end));
    assert.deepEqual(errors, []);
    await page.close();
  });
}
