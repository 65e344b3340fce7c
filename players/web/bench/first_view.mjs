// Is the first view as fine as the screen? node bench/first_view.mjs PACK ...
//
// For each pack and screen: the level that the page chose for its first picture, and the PSNR of that level against full
// detail inside the outline, in the worst of FRAMES frames of each clip; and that of the canvas's pixels, of which a
// screen may have more. "same": the level is full detail.
import { readFile } from "node:fs/promises";
import { basename, join } from "node:path";
import { HERE, launch, serve } from "../tests/browser.mjs";

const PAGE = join(HERE, "../../../exporter/avatar_export/viewer_page");
const SCREENS = [[1280, 900, 1], [1280, 900, 2], [390, 844, 2], [390, 844, 3]]; // CSS pixels, and physical ones of each
const FRAMES = 4; // of each clip
const MOST_DB = 200; // beyond: the same picture

const packs = process.argv.slice(2);
if (packs.length === 0) {
  console.error("first_view.mjs: name the packs");
  process.exit(2);
}
const avatars = packs.map((file, i) => ({ id: `a${i}`, name: basename(file), file: `${i}.avatar`, preview: null }));
const files = { "/session.json": Buffer.from(JSON.stringify({ avatars, present: true })) };
for (const name of ["index.html", "viewer.js", "viewer.css"]) files[`/${name}`] = join(PAGE, name);
for (const [i, file] of packs.entries()) files[`/${i}.avatar`] = await readFile(file);
const server = await serve(files);
const browser = await launch({ webgpu: false });
console.log("| pack | screen | level | worst dB | against the screen's pixels, dB |\n|---|---|---|---|---|");
for (const { id, name } of avatars) for (const screen of SCREENS) await show(id, name, ...screen);
await browser.close();
server.close();

async function show(id, name, width, height, deviceScaleFactor) {
  const page = await browser.newPage();
  await page.setViewport({ width, height, deviceScaleFactor });
  await page.goto(`${server.address}/index.html?backend=webgl2&play=0&avatar=${id}`);
  const level = await page.evaluate(() => window.avatarViewer.ready.then(() => window.avatarViewer.instance.level));
  await page.evaluate(prepare);
  const frames = await page.evaluate((count) => window.frames(count), FRAMES);
  let levels = Infinity, pixels = Infinity;
  const whole = await page.evaluate(() => window.avatarViewer.player.canvas.height === innerHeight * devicePixelRatio);
  for (const frame of level === 0 && whole ? [] : frames) {
    await page.setViewport({ width, height, deviceScaleFactor });
    levels = Math.min(levels, await page.evaluate((...given) => window.worst(...given), frame, level));
    await page.setViewport({ width: width * deviceScaleFactor, height: height * deviceScaleFactor });
    pixels = Math.min(pixels, await page.evaluate(() => window.against()));
  }
  const db = (value) => (value > MOST_DB ? "same" : value.toFixed(1));
  console.log(`| ${name} | ${width}x${height} at ${deviceScaleFactor} | ${level} | ${db(levels)} | ${db(pixels)} |`);
  await page.close();
}

/** Runs in the page: makes functions there. */
function prepare() {
  const { avatarViewer: viewer } = window;
  const field = (id) => document.getElementById(id);
  const set = (id, value, event) => {
    field(id).value = value;
    field(id).dispatchEvent(new Event(event));
  };
  const drawn = async () => {
    for (let seen = -1; seen !== viewer.frames; ) {
      seen = viewer.frames;
      await new Promise((done) => setTimeout(done, 200));
    }
    await viewer.player.finished();
    const { width, height } = viewer.player.canvas;
    return { pixels: await viewer.player.readPixels(), width, height };
  };
  /** Of `other`, enlarged as a browser does, inside the outline of `full`: where its alpha is above one half. */
  const psnr = (full, other) => {
    const across = other.width / full.width, down = other.height / full.height;
    let sum = 0, count = 0;
    for (let y = 0; y < full.height; y++) {
      const v = Math.min(other.height - 1, Math.max(0, (y + 0.5) * down - 0.5)), top = Math.floor(v), below = Math.min(top + 1, other.height - 1);
      for (let x = 0; x < full.width; x++) {
        const at = 4 * (y * full.width + x);
        if (full.pixels[at + 3] <= 0.5) continue;
        const u = Math.min(other.width - 1, Math.max(0, (x + 0.5) * across - 0.5)), left = Math.floor(u), right = Math.min(left + 1, other.width - 1);
        for (let k = 0; k < 3; k++) {
          const value = (row, column) => other.pixels[4 * (row * other.width + column) + k];
          const high = value(top, left) + (u - left) * (value(top, right) - value(top, left));
          const low = value(below, left) + (u - left) * (value(below, right) - value(below, left));
          sum += (full.pixels[at + k] - high - (v - top) * (low - high)) ** 2;
        }
        count += 3;
      }
    }
    return Math.min(999, -10 * Math.log10(sum / count));
  };
  let chosen;
  /** [clip, seconds] of `count` frames of each clip; [-1, 0] without clips. */
  window.frames = (count) => {
    const found = [];
    for (let clip = 0; clip < field("clip").options.length; clip++) {
      set("clip", field("clip").options[clip].value, "change");
      for (let i = 0; i < count; i++) found.push([clip, (field("timeline").max * (i + 0.5)) / count]);
    }
    return found.length > 0 ? found : [[-1, 0]];
  };
  /** Keeps what the page shows of a frame, and compares it with full detail. */
  window.worst = async ([clip, seconds], level) => {
    if (clip >= 0) {
      if (field("clip").selectedIndex !== clip) set("clip", field("clip").options[clip].value, "change");
      set("timeline", seconds, "input");
    }
    set("level", "", "change");
    chosen = await drawn();
    if (level === 0) return 999;
    set("level", "0", "change");
    return psnr(await drawn(), chosen);
  };
  /** Compares what was kept with full detail in the present size. */
  window.against = async () => {
    set("level", "0", "change");
    return psnr(await drawn(), chosen);
  };
}
