// What a person does with the viewer page and sees of it, for viewer.test.mjs.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { gunzipSync, gzipSync } from "node:zlib";
import { launch, serve } from "./browser.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
export const PACKS = join(HERE, "../../../tests/data/packs/1.0");
export const RECORDING = join(HERE, "../../../samples/drive/live_link_face_rom_300.csv");
export const BACKEND = process.env.BACKEND ?? "webgl2";
const SMALL = { width: 340, height: 260 }; // of the window: the canvas is smaller
export const WAIT_MS = 60_000;

export let server, page, errors;
let browser, folder;

/** A pack with another document: `change` edits it. */
export function edited(bytes, change) {
  const body = gunzipSync(bytes);
  const size = Number(body.readBigUInt64LE(0));
  const header = JSON.parse(body.subarray(8, 8 + size));
  const document = JSON.parse(header.__metadata__.pack);
  change(document);
  header.__metadata__.pack = JSON.stringify(document);
  const text = Buffer.from(JSON.stringify(header));
  const padded = Buffer.concat([text, Buffer.alloc((8 - (text.length % 8)) % 8, " ")]);
  const length = Buffer.alloc(8);
  length.writeBigUInt64LE(BigInt(padded.length));
  return gzipSync(Buffer.concat([length, padded, body.subarray(8 + size)]));
}

/** ARKit cannot drive it. */
export function undriven(document) {
  document.avatar.driving = { mode: "none" };
  delete document.driving;
}

/** Builds the page and serves it with packs that are sound, cut, too new, or none. */
export async function begin() {
  folder = await mkdtemp(join(tmpdir(), "viewer-"));
  execFileSync(process.execPath, [join(HERE, "../build.mjs"), "page", "--out", folder]);
  const joints = await readFile(join(PACKS, "joints.avatar"));
  const files = {
    "joints.avatar": joints,
    "surface.avatar": await readFile(join(PACKS, "surface.avatar")),
    "cut.avatar": joints.subarray(0, joints.length / 2),
    "right.avatar": await readFile(join(PACKS, "../../mole/right.avatar")),
    "left.avatar": await readFile(join(PACKS, "../../mole/left.avatar")),
    "newer.avatar": edited(joints, (document) => (document.asset.minVersion = "99.0")),
    "nothing.avatar": Buffer.from("nothing"),
  };
  for (const [name, bytes] of Object.entries(files)) await writeFile(join(folder, name), bytes);
  const entry = (id) => ({ id, name: id, file: `${id}.avatar`, preview: null, bytes: files[`${id}.avatar`].length, license: "CC0-1.0", consent: null });
  const session = { avatars: ["joints", "surface", "cut", "newer", "nothing", "right", "left"].map(entry), live: true, events: true };
  const served = { "/session.json": Buffer.from(JSON.stringify(session)) };
  served["/published/session.json"] = Buffer.from(JSON.stringify({ ...session, live: false, events: false }));
  for (const name of ["index.html", "viewer.js", "viewer.css", ...Object.keys(files)]) {
    served[`/${name}`] = served[`/published/${name}`] = join(folder, name);
  }
  server = await serve(served);
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

/** Opens the page and waits for the first picture. */
export async function open(avatar, size = SMALL) {
  await newPage();
  await page.setViewport(size);
  await page.evaluateOnNewDocument(fakeSocket);
  await page.goto(`${server.address}/index.html?backend=${BACKEND}&play=0&avatar=${avatar}`);
}

/** In the page: a WebSocket that a test can speak through. */
function fakeSocket() {
  window.said = [];
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
}

export async function opened(avatar, size) {
  await open(avatar, size);
  await page.evaluate(() => window.avatarViewer.ready);
}

/** The image without its background, as [size, sum of |x| weighted by place, alpha]. */
export async function picture() {
  await settled();
  return page.evaluate(async () => {
    const { player } = window.avatarViewer;
    await player.finished();
    const pixels = await player.readPixels();
    let place = 0;
    let alpha = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      alpha += pixels[i + 3];
      place += (pixels[i] + 2 * pixels[i + 1] + 3 * pixels[i + 2]) * (1 + (i % 997));
    }
    return { floats: pixels.length, place, alpha };
  });
}

/** Waits until no frame was drawn for a while. */
export async function settled() {
  await page.evaluate(async () => {
    let seen = -1;
    while (seen !== window.avatarViewer.frames) {
      seen = window.avatarViewer.frames;
      await new Promise((done) => setTimeout(done, 150));
    }
  });
}

export async function changes(act) {
  const old = await picture();
  await act();
  const now = await picture();
  assert.ok(Math.abs(old.place - now.place) > 1e-6 * Math.abs(old.place), "the picture did not change");
  return now;
}

export async function message(part) {
  await page.waitForFunction((text) => document.querySelector("#messages").innerText.includes(text), { timeout: WAIT_MS }, part);
}

/** Texts of the elements that a person sees. */
export function visible(selector) {
  return page.$$eval(selector, (all) => all.filter((one) => one.checkVisibility()).map((one) => one.innerText));
}

export const slider = (label) => `input[type=range][aria-label="${label}"]`;
export const valueOf = (label) => page.$eval(slider(label), (input) => input.valueAsNumber);

/** Drops files onto the page. */
export async function drop(...files) {
  await page.evaluate((given) => {
    const transfer = new DataTransfer();
    for (const [name, base64] of given) {
      transfer.items.add(new File([Uint8Array.from(atob(base64), (c) => c.charCodeAt(0))], name));
    }
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
  const box = await (await page.$("#stage")).boundingBox();
  return [box.x + box.width / 2, box.y + box.height / 2];
}

/** The rgba floats of the page's image, and its width. */
export async function imageOf() {
  await settled();
  return page.evaluate(async () => {
    const { player } = window.avatarViewer;
    await player.finished();
    return { pixels: [...(await player.readPixels())], width: player.canvas.width };
  });
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
