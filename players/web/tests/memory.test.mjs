// What frames compute again and allocate, and what loading leaves behind. LONG=1 measures WebGPU too, which is slow in software; LIT takes
// a pack that can be lit, and another light for each frame.
import assert from "node:assert/strict";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { CHROMIUM, PACKS, PAGE, launch, notHere, open, scriptOf, serve } from "./browser.mjs";

const BACKENDS = CHROMIUM ? ["webgl2", "webgpu"] : ["webgl2"];
const FRAMES = 1000;
const WARM = { webgl2: 2000, webgpu: 800 };
const LOADS = 50;
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
const SAMPLING = { samplingInterval: 64, includeObjectsCollectedByMajorGC: true, includeObjectsCollectedByMinorGC: true };

let browser, server, script;

before(async () => {
  script = await scriptOf("memory");
  server = await serve({ "/index.html": PAGE, "/page.js": Buffer.from(script), "/a.avatar": process.env.LIT ?? join(PACKS, "joints.avatar") });
  browser = await launch();
});
after(async () => {
  await browser?.close();
  server?.close();
});

async function started(backend) {
  const { page, errors } = await open(browser, `${server.address}/index.html`);
  await page.evaluate((b) => window.start(b, "a.avatar"), backend);
  return { page, errors };
}

/** Bytes of JavaScript that live after a collection. */
async function liveBytes(clients) {
  let sum = 0;
  for (const client of clients) {
    for (let i = 0; i < 2; i++) await client.send("HeapProfiler.collectGarbage");
    sum += (await client.send("Runtime.getHeapUsage")).usedSize;
  }
  return sum;
}

/** Runs `run`; returns ["src/FILE.ts FUNCTION", bytes] of all that was allocated, also what was collected since. */
async function allocated(client, run) {
  let file;
  const files = script.split("\n").map((line) => (file = /^ *\/\/ (\S+\.[jt]s)$/.exec(line)?.[1] ?? file)); // comments of esbuild
  await client.send("HeapProfiler.startSampling", SAMPLING);
  await run();
  const { profile } = await client.send("HeapProfiler.stopSampling");
  const found = {};
  const walk = ({ callFrame: { url, lineNumber, functionName }, selfSize, children }) => {
    const name = `${(url && files[lineNumber]) || "?"} ${functionName || "(anonymous)"}:${lineNumber}`;
    if (selfSize > 0) found[name] = (found[name] ?? 0) + selfSize;
    children.forEach(walk);
  };
  walk(profile.head);
  return Object.entries(found);
}

/** Measures until a number of bytes is below `limit`, at most TRIALS times. */
async function flat(t, what, limit, measure) {
  let bytes = Infinity;
  for (let trial = 0; trial < TRIALS && bytes >= limit; trial++) bytes = Math.min(bytes, await measure());
  t.diagnostic(`${what}: ${bytes} bytes`);
  assert.ok(bytes < limit, `${what}: ${bytes} bytes`);
}

for (const backend of BACKENDS) {
  test(`${backend}: after a change of the camera, of the pose, and of nothing, the image is that of all passes`, { timeout: 240_000 }, async () => {
    const { page, errors } = await started(backend);
    const image = (pose, camera) => page.evaluate((...given) => window.image(...given), pose, camera);
    const first = await image(1, 1); // nothing was run before
    assert.notEqual(await image(1, 0), first, "another camera gives another image");
    assert.equal(await image(1, 1), first, "camera");
    assert.notEqual(await image(0, 1), first, "another pose gives another image");
    assert.equal(await image(1, 1), first, "pose");
    assert.equal(await image(1, 1), first, "nothing");
    assert.equal(await page.evaluate(() => window.misread(100)), 0, "read before it was drawn");
    assert.deepEqual(errors, []);
    await page.close();
  });
}

for (const backend of BACKENDS.slice(0, process.env.LONG === "1" ? 2 : 1)) {
  test(`${backend}: frames keep nothing, loads leave nothing`, { timeout: 240_000, skip: notHere }, async (t) => {
    const { page, errors } = await started(backend);
    const frames = (n = FRAMES) => page.evaluate((count) => window.frames(count), n);
    await frames(WARM[backend]); // until V8 has compiled what it will
    const clients = [await page.createCDPSession(), ...page.workers().map((worker) => worker.client)];
    let objects;
    await flat(t, `kept of ${FRAMES} frames`, FLAT, async () => {
      const before = await liveBytes(clients);
      objects = await frames();
      return (await liveBytes(clients)) - before;
    });
    if (backend === "webgl2") {
      await flat(t, "allocated by a function of the page", FLAT, async () => {
        const found = (await allocated(clients[0], frames)).filter(([name]) => name.startsWith("src/"));
        assert.ok(found.some(([name]) => OF_CALLER.test(name)), "the sampler sees files of src/");
        return Math.max(0, ...found.filter(([name]) => !OF_CALLER.test(name)).map(([, bytes]) => bytes));
      });
      await flat(t, "allocated by the worker's functions", FLAT, async () => {
        const found = (await allocated(clients[1], frames)).filter(([name]) => !/ (\(.*\)|.*onmessage):/.test(name));
        return found.reduce((sum, [, bytes]) => sum + bytes, 0);
      });
    }
    const load = (n) => page.evaluate((count) => window.loads("a.avatar", count), n);
    await load(LOADS / 2); // fills the browser's own caches
    await flat(t, `left by ${LOADS} loads`, LOADS * BYTES_A_LOAD, async () => {
      const settled = await liveBytes(clients);
      assert.deepEqual(await load(LOADS), objects, "GPU objects");
      return (await liveBytes(clients)) - settled;
    });
    const end = await page.evaluate(() => window.dispose());
    assert.ok(Object.values(end).every((count) => count === 0), JSON.stringify(end));
    assert.deepEqual(errors, []);
    await page.close();
  });
}
