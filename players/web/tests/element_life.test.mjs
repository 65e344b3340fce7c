// What elements <gaussian-avatar> share, keep and give back: node --test tests/element_life.test.mjs. LONG=1 takes longer.
import assert from "node:assert/strict";
import { test } from "node:test";
import { CHROMIUM, launch, notHere, open } from "./browser.mjs";
import { STILL, check, page, server } from "./element_page.mjs";

const MOUNTS = process.env.LONG === "1" ? 100 : 30; // browsers take about 16 contexts
const HOUR_FRAMES = 500, HOUR_MS = 3_600_000, SETTLED_FRAMES = 50;
// The smallest object has 12 bytes: one that each frame kept would be more than this. V8 compiles when it finds the time,
// so that the least of some trials counts.
const FLAT = 5_000, TRIALS = 4;

check("several share one worker and one context, and each has its own picture", async () => {
  const seen = await page.evaluate(async (still) => {
    const before = window.made.workers;
    const row = Object.assign(document.createElement("div"), { style: "display: flex" });
    document.body.append(row);
    const elements = await Promise.all(["joints", "surface", "levels", "joints"].map((name) => window.shown({ ...still, src: `${name}.avatar` }, row)));
    await Promise.all(elements.map((one) => window.rests(one)));
    return {
      workers: window.made.workers - before, contexts: window.contexts.filter((gl) => !gl.isContextLost()).length, running: window.running.size,
      pictures: elements.map((one) => window.picture(one)),
    };
  }, STILL);
  assert.deepEqual([seen.workers, seen.contexts, seen.running], [1, 1, 1]);
  assert.ok(seen.pictures.every(({ alpha }) => alpha > 50));
  const places = seen.pictures.map(({ place }) => place);
  assert.equal(new Set(places).size, 3);
  assert.equal(places[0], places[3]);
});

check("a move in the page keeps all, removal gives all back", async () => {
  const seen = await page.evaluate(async (still) => {
    const element = await window.shown({ ...still, poster: "data:," });
    const [canvas, fetches] = [window.canvasOf(element), window.made.fetches];
    element.setExpression(element.avatar.expressions[0].name, 1);
    await window.rests(element);
    const before = window.picture(element).place;
    const box = document.body.appendChild(document.createElement("div"));
    box.append(element);
    await window.wait(60);
    const kept = window.canvasOf(element) === canvas && window.made.fetches === fetches && element.avatar !== null;
    element.remove();
    await window.wait(60);
    const gone = [window.running.size, window.canvasOf(element), element.avatar];
    const loaded = window.next(element, "load");
    box.append(element);
    await loaded;
    return { kept, gone, same: window.picture(element).place === before, alpha: window.picture(element).alpha };
  }, STILL);
  assert.deepEqual([seen.kept, seen.gone, seen.same], [true, [0, null, null], false]);
  assert.ok(seen.alpha > 100);
});

check(`${MOUNTS} mounts and unmounts leave the page its own WebGL`, async () => {
  const seen = await page.evaluate(async (still, mounts) => {
    const own = window.ownContext();
    const canvas = document.createElement("canvas"); // of one player after the other
    for (let i = 0; i < 2; i++) (await window.Player.create(canvas, { backend: "webgl2" })).dispose();
    for (let i = 0; i < mounts; i++) {
      const element = await window.shown({ ...still, style: "width: 40px" });
      element.remove();
      await window.wait(0);
    }
    await window.wait(50);
    return { own: own(), running: window.running.size };
  }, STILL, MOUNTS);
  assert.deepEqual(seen, { own: true, running: 0 });
});

check(`an hour of idle life in ${HOUR_FRAMES} frames keeps nothing`, async (t) => {
  await page.evaluate(async () => {
    window.countGpu("webgl2");
    window.one = await window.shown({ src: "joints.avatar", style: "width: 40px" });
    window.now = performance.now();
    window.requestAnimationFrame = (callback) => void (window.pending = callback);
    await window.wait(60); // the frame that was asked for by the browser's own
  });
  const frames = (count, milliseconds) => page.evaluate(async (n, step) => {
    for (let i = 0; i < n; i++) {
      const { pending } = window;
      window.pending = null;
      pending((window.now += step));
      await window.one.stage.player.finished();
    }
    return { ...window.alive };
  }, count, milliseconds);
  const client = CHROMIUM ? await page.createCDPSession() : null;
  const clients = CHROMIUM ? [client, ...page.workers().map((worker) => worker.client)] : [];
  const heap = async () => {
    let sum = 0;
    for (const one of clients) {
      for (let i = 0; i < 2; i++) await one.send("HeapProfiler.collectGarbage");
      sum += (await one.send("Runtime.getHeapUsage")).usedSize;
    }
    return sum;
  };
  const step = HOUR_MS / HOUR_FRAMES;
  let kept = Infinity;
  for (let trial = 0; trial < TRIALS && kept >= FLAT; trial++) {
    const settled = await frames(SETTLED_FRAMES, step);
    const before = await heap();
    const objects = await frames(HOUR_FRAMES - SETTLED_FRAMES, step);
    kept = Math.min(kept, (await heap()) - before);
    t.diagnostic(`hour ${trial + 1}: kept ${kept} bytes; GPU objects ${JSON.stringify(objects)}`);
    assert.deepEqual(objects, settled);
  }
  assert.ok(kept < FLAT, `${kept} bytes`);
  const end = await page.evaluate(async () => {
    window.one.remove();
    await window.wait(50);
    return Object.values(window.alive);
  });
  assert.ok(end.every((count) => count === 0), JSON.stringify(end));
});

test("WebGPU: elements share one device, which goes with the last; a disposed player says so", { timeout: 240_000, skip: notHere }, async () => {
  const gpu = await launch({ webgpu: "shown" });
  try {
    const opened = await open(gpu, `${server.address}/index.html`);
    const seen = await opened.page.evaluate(async (still) => {
      const elements = await Promise.all(["joints", "surface", "joints"].map((name) => window.shown({ ...still, src: `${name}.avatar`, style: "width: 60px" })));
      await Promise.all(elements.map((one) => window.rests(one)));
      const players = elements.map(({ stage }) => stage.player);
      const alphas = [];
      for (const one of elements) {
        await one.stage.drawn();
        alphas.push(window.picture(one).alpha > 30);
      }
      const lost = [];
      for (const player of players) void player.lost.then(() => lost.push(player));
      elements[0].remove();
      elements[1].remove();
      await window.wait(100);
      const early = lost.length;
      elements[2].remove();
      await players[2].lost;
      let said;
      try {
        players[2].frame(null);
      } catch (error) {
        said = `${error.name}: ${error.message}`;
      }
      return { kinds: players.map(({ backend }) => backend), alphas, early, asked: window.made.devices, said };
    }, STILL);
    const said = "AvatarError: this player was disposed of; make another with Player.create";
    assert.deepEqual(seen, { kinds: Array(3).fill("webgpu"), alphas: Array(3).fill(true), early: 0, asked: 1, said });
    assert.deepEqual(opened.errors, []);
  } finally {
    await gpu.close();
  }
});
