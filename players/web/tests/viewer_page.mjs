// What a person does with the viewer page and sees of it, for viewer.test.mjs.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { HERE, PACKS, launch, serve } from "./browser.mjs";
import { repacked } from "./parts.mjs";

export const RECORDING = join(HERE, "../../../samples/drive/live_link_face_rom_300.csv");
export const BACKEND = process.env.BACKEND ?? "webgl2";
const SMALL = { width: 340, height: 260 }; // of the window: the canvas is smaller
const WAIT_MS = 60_000;

export let server, page, errors;
let browser, folder;

/** A pack that ARKit cannot drive. */
export function undriven(file) {
  return repacked(file, ({ document }) => {
    document.avatar.driving = { mode: "none" };
    delete document.driving;
  });
}

/** Builds the page and serves it with packs that are sound, cut, too new, or none. */
export async function begin() {
  folder = await mkdtemp(join(tmpdir(), "viewer-"));
  execFileSync(process.execPath, [join(HERE, "../build.mjs"), "page", "--out", folder]);
  const [joints, surface, right, left] = await Promise.all(
    ["joints", "surface", "../../mole/right", "../../mole/left"].map((name) => readFile(join(PACKS, `${name}.avatar`))),
  );
  const newer = repacked(joints, ({ document }) => (document.asset.minVersion = "99.0"));
  const odd = repacked(joints, ({ document }) => (document.avatar.clips[0].name = "n\u202eo\u001bd"));
  const packs = { joints, surface, odd, cut: joints.subarray(0, joints.length / 2), newer, nothing: Buffer.from("nothing"), right, left };
  if (process.env.LIT) packs.lit = await readFile(process.env.LIT); // a pack that can be lit
  const served = {};
  for (const name of ["index.html", "viewer.js", "viewer.css"]) served[name] = join(folder, name);
  for (const [id, bytes] of Object.entries(packs)) await writeFile((served[`${id}.avatar`] = join(folder, `${id}.avatar`)), bytes);
  const avatars = Object.entries(packs).map(([id, { length }]) => {
    return { id, name: id, file: `${id}.avatar`, preview: null, bytes: length, license: "CC0-1.0", consent: null };
  });
  const at = (place, live) =>
    Object.entries({ ...served, "session.json": Buffer.from(JSON.stringify({ avatars, live, events: live })) }).map(([name, file]) => [place + name, file]);
  server = await serve(Object.fromEntries([...at("/", true), ...at("/published/", false)]));
  browser = await launch({ webgpu: BACKEND === "webgpu" });
}

export async function end() {
  await browser?.close();
  server?.close();
  if (folder) await rm(folder, { recursive: true });
}

/** A new page of the browser, in place of the one before. */
export async function newPage() {
  await page?.close();
  page = await browser.newPage();
  errors = [];
  page.on("pageerror", (error) => errors.push(error.message));
}

/** Opens the page; a test can speak through its WebSocket. */
export async function open(avatar, size = SMALL) {
  await newPage();
  await page.setViewport(size);
  await page.evaluateOnNewDocument(() => {
    window.said = [];
    window.contexts = []; // of WebGL
    const { getContext } = HTMLCanvasElement.prototype;
    HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
      const context = getContext.call(this, kind, ...options);
      if (kind === "webgl2") window.contexts.push(context);
      return context;
    };
    window.WebSocket = class extends EventTarget {
      static OPEN = 1;
      readyState = 1;
      constructor() {
        super();
        window.hear = (value) => this.dispatchEvent(new MessageEvent("message", { data: JSON.stringify(value) }));
      }
      send(text) {
        window.said.push(JSON.parse(text));
      }
    };
  });
  await page.goto(`${server.address}/index.html?backend=${BACKEND}&play=0&avatar=${avatar}`);
}

/** Opens the page, all sections unfolded, and waits for the first picture. */
export async function opened(avatar, size) {
  await open(avatar, size);
  await page.evaluate(() => window.avatarViewer.ready);
  await page.$$eval("details", (all) => all.forEach((one) => (one.open = true)));
}

/** What a function says in the page, of the viewer. */
export const viewer = (read, ...given) => page.evaluate(`(${read})(window.avatarViewer, ...${JSON.stringify(given)})`);
export const until = (condition, ...given) => page.waitForFunction(condition, { timeout: WAIT_MS }, ...given);
export const message = (part) => until((text) => document.querySelector("#messages").innerText.includes(text), part);
export const texts = (selector) => page.$eval(selector, (element) => element.textContent);
export const label = (selector) => page.$eval(selector, (element) => element.getAttribute("aria-label"));

/** Waits until no frame was drawn for a while. */
export function settled() {
  return viewer(async (shown) => {
    for (let seen = -1; seen !== shown.frames; ) {
      seen = shown.frames;
      await new Promise((done) => setTimeout(done, 150));
    }
  });
}

/** The image without its background: [numbers, sum weighted by place, alpha]. */
export async function picture() {
  await settled();
  return viewer(async ({ player }) => {
    await player.finished();
    const pixels = await player.readPixels();
    let place = 0, alpha = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      alpha += pixels[i + 3];
      place += (pixels[i] + 2 * pixels[i + 1] + 3 * pixels[i + 2]) * (1 + (i % 997));
    }
    return { floats: pixels.length, place, alpha };
  });
}

export async function changes(act) {
  const old = await picture();
  await act();
  const now = await picture();
  assert.ok(Math.abs(old.place - now.place) > 1e-6 * Math.abs(old.place), "the picture did not change");
}

/** Texts of the elements that a person sees. */
export function visible(selector) {
  return page.$$eval(selector, (all) => all.filter((one) => one.checkVisibility()).map((one) => one.innerText));
}

export const slider = (name) => `input[type=range][aria-label="${name}"]`;
export const valueOf = (name) => page.$eval(slider(name), (input) => input.valueAsNumber);

/** Sets an input as a person does. */
export async function enter(selector, value) {
  await page.waitForSelector(selector);
  await page.$eval(selector, (input, given) => {
    input.value = given;
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }, value);
}

/** Drops files onto the page. */
export async function drop(...files) {
  await page.evaluate((given) => {
    const transfer = new DataTransfer();
    for (const [name, base64] of given) transfer.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
    window.dispatchEvent(new DragEvent("drop", { dataTransfer: transfer, cancelable: true, bubbles: true }));
  }, files.map(([name, bytes]) => [name, bytes.toString("base64")]));
}

export async function drag(from, to, options = {}) {
  await page.mouse.move(...from);
  await page.mouse.down(options);
  await page.mouse.move(...to, { steps: 4 });
  await new Promise((done) => setTimeout(done, 60)); // held still: no inertia
  await page.mouse.up(options);
}

/** The middle of the canvas. */
export async function middle() {
  const { x, y, width, height } = await (await page.$("#stage")).boundingBox();
  return [x + width / 2, y + height / 2];
}

/** The rgba floats of the page's image, and its width. */
export async function imageOf() {
  await settled();
  return viewer(async ({ player }) => ({ pixels: [...(await player.readPixels())], width: player.canvas.width }));
}

/** Column of what is red, or has another channel above the others, as a share of the width. */
export function columnOf({ pixels, width }, channel) {
  let sum = 0, column = 0;
  for (let i = 0; i < pixels.length; i += 4) {
    const others = [0, 1, 2].filter((other) => other !== channel).map((other) => pixels[i + other]);
    const weight = Math.max(0, pixels[i + channel] - Math.max(...others) - 0.15);
    sum += weight;
    column += weight * ((i / 4) % width);
  }
  assert.ok(sum > 1, `nothing of channel ${channel}`);
  return column / sum / width;
}
