// Scenes of engines in pages, for adapters.test.mjs and lit/adapters.test.mjs.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { HERE, PACKS, PAGE, launch, open, scriptOf, serve } from "./browser.mjs";

const MOLE = join(PACKS, "../../mole"); // a head with a mole on its left cheek, in both frames
const FILES = { "/first.avatar": join(PACKS, "joints.avatar"), "/second.avatar": join(PACKS, "surface.avatar") };
if (process.env.LIT) FILES["/lit.avatar"] = process.env.LIT; // a pack that can be lit
if (process.env.CASTS) for (const { file, path } of JSON.parse(readFileSync(process.env.CASTS))) FILES[file] = path;
for (const hand of ["right", "left"]) FILES[`/${hand}.avatar`] = join(MOLE, `${hand}.avatar`);
export const SIZE = 128;
export const DISTANCE = 0.6; // of the camera
export const PART = [40, 16, 64]; // of a viewport: x, y from below, size
export const WALL = [200, 90, 30];
export const BACKGROUND = [40, 60, 120];
const OPTIONS = { distance: DISTANCE, antialias: false, target: false, synchronous: false };
let browser;
const scripts = new Map(); // by entry point and stage

export async function begin() {
  browser = await launch();
}

export async function end() {
  await browser?.close();
}

/** Calls `play` of harness/adapters/ENTRY.js, that asks for `stage`, in a page of its own. Returns what it returns, what it posted, and errors. */
export async function play(entry, stage, ...values) {
  const key = `${entry} ${stage}`;
  if (!scripts.has(key)) scripts.set(key, await scriptOf(`adapters/${entry}`, { stage: join(HERE, `harness/adapters/${stage}.js`) }));
  const server = await serve({ ...FILES, "/index.html": PAGE, "/page.js": Buffer.from(scripts.get(key)) });
  try {
    const { page, errors } = await open(browser, `${server.address}/index.html`);
    await page.waitForFunction(() => window.play !== undefined, { timeout: 60_000 }).catch((error) => {
      throw new Error([error.message, ...errors].join("\n"));
    });
    const result = await page.evaluate((all) => window.play(...all), values);
    await page.close();
    return [result, Object.fromEntries(server.written), errors];
  } finally {
    server.close();
  }
}

/** Plays steps with a stage. Returns what was posted: pictures as RGBA bytes, first row on top. */
export async function pictures({ stage, ...options }, steps) {
  const [errors, posted, others] = await play("page", stage, { ...OPTIONS, ...options }, steps);
  const lost = steps.some(([what]) => what === "lose");
  assert.deepEqual([...errors, ...others].filter((error) => !lost || !/context|CONTEXT_LOST/i.test(error)), []);
  return posted;
}

/** The largest difference of two pictures, in steps of 1/255; `inside(x)` chooses columns. */
export function difference(a, b, inside = () => true) {
  let most = 0;
  for (let i = 0; i < 4 * SIZE * SIZE; i++) {
    if (i % 4 < 3 && inside((i >> 2) % SIZE)) most = Math.max(most, Math.abs(a[i] - b[i]));
  }
  return most;
}
