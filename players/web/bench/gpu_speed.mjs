// Frames a second in Chromium's headless shell, with a new pose and camera in each, on both backends: npm run gpu-speed -- PACK ...
//
//   AVATAR_GPU=1 npm run gpu-speed -- [--seconds 3] [--picture FILE.png] PACK ...
//
// AVATAR_GPU=1 takes the machine's own GPU; without it the GPU is software. Frames are put on a canvas of the page, and
// every frame is waited for, so nothing runs ahead. --picture keeps what the page showed last on WebGPU.
import { basename } from "node:path";
import { parseArgs } from "node:util";
import { bundle } from "../bundle.mjs";
import { launch, open, serve } from "../tests/browser.mjs";

const SIZES = [[512, 512], [1920, 1080]];
const options = { seconds: { type: "string", default: "3" }, picture: { type: "string" } };
const { values, positionals: packs } = parseArgs({ options, allowPositionals: true });
if (packs.length === 0) {
  console.error("gpu_speed.mjs: there is no pack; name one");
  process.exit(2);
}

const HTML = "<!doctype html><title>speed</title><link rel=icon href=data:,><body style=margin:0><script type=module src=page.js></script>";
const SCRIPT = `
import { Camera, Player, load } from "./index.ts";

/** What draws, and milliseconds a frame: the median. */
window.measure = async (url, backend, width, height, seconds) => {
  document.querySelector("canvas")?.remove();
  const canvas = document.createElement("canvas");
  document.body.append(canvas);
  const player = await Player.create(canvas, { backend });
  const { pose, avatar } = player.add(await load(url));
  const camera = new Camera(), { target, size } = avatar.framing.head ?? avatar.framing.whole, times = [];
  const end = performance.now() + 1000 * seconds;
  for (let i = 0; performance.now() < end || i < 8; i++) {
    const begin = performance.now();
    pose.expressionWeights.forEach((_, k) => (pose.expressionWeights[k] = 0.1 + 0.1 * Math.sin(0.2 * i + k)));
    camera.orbit(target, 2 * Math.max(...size), 0.3 * Math.sin(0.37 * i), 0, 0.6, width, height);
    player.frame(camera, [1, 1, 1]);
    await player.finished();
    times.push(performance.now() - begin);
  }
  const kept = times.slice(4).sort((a, b) => a - b);
  return { splats: player.splats, frames: times.length, ms: kept[kept.length >> 1] };
};

window.gpu = async () => {
  const info = (await navigator.gpu?.requestAdapter())?.info;
  const gl = document.createElement("canvas").getContext("webgl2");
  const named = gl?.getExtension("WEBGL_debug_renderer_info");
  const renderer = gl?.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  return { webgpu: info && [info.vendor, info.architecture, info.description].join(" "), webgl2: renderer };
};`;

const stdin = { contents: SCRIPT, resolveDir: new URL("../src", import.meta.url).pathname, loader: "ts" };
const { outputFiles } = await bundle({ stdin, write: false });
const files = { "/index.html": Buffer.from(HTML), "/page.js": Buffer.from(outputFiles[0].contents) };
packs.forEach((pack, i) => (files[`/${i}.avatar`] = pack));
const server = await serve(files);
const browser = await launch({ webgpu: "shown" });
try {
  const { page } = await open(browser, `${server.address}/index.html`);
  await page.setViewport({ width: SIZES[1][0], height: SIZES[1][1] });
  const named = await page.evaluate(() => window.gpu());
  console.log(`webgpu: ${named.webgpu}; webgl2: ${named.webgl2}\n`);
  console.log("| pack | splats | size | backend | ms a frame | frames a second |\n|---|---|---|---|---|---|");
  for (const [i, pack] of packs.entries()) {
    for (const [width, height] of SIZES) {
      for (const backend of ["webgl2", "webgpu"]) {
        const measure = (...words) => window.measure(...words);
        const told = await page.evaluate(measure, `/${i}.avatar`, backend, width, height, Number(values.seconds)).catch(String);
        const row = typeof told === "string" ? [0, told.slice(0, 120), ""] : [told.splats, told.ms.toFixed(1), (1000 / told.ms).toFixed(1)];
        console.log(`| ${basename(pack)} | ${row[0]} | ${width}x${height} | ${backend} | ${row[1]} | ${row[2]} |`);
      }
    }
  }
  if (values.picture) await page.screenshot({ path: values.picture });
} finally {
  await browser.close();
  server.close();
}
