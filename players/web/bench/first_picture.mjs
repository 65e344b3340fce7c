// Bytes and seconds from an empty cache to the first picture, at 10 Mbit/s: npm run first-picture.
//
//   npm run first-picture -- [--pack FILE ...] [--site FOLDER]
//
// The page is one script, the package and a canvas; --site takes a folder that `publish` wrote instead. Bytes are those
// until the first picture of the player. Text is sent gzipped, as web servers do.
import { createServer } from "node:http";
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { gzipSync } from "node:zlib";
import { bundle } from "../bundle.mjs";
import { launch } from "../tests/browser.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
const MBIT_S = 10;
const LATENCY_MS = 40;
const SIZE = 512; // pixels
const MOST_MS = 60_000;
const { values: options } = parseArgs({ options: { pack: { type: "string", multiple: true }, site: { type: "string" } } });
const built = (name) => join(HERE, "../build/bench/avatars", `${name}.avatar`);
const packs = options.site ? [options.site] : options.pack ?? ["head", "lam"].map(built).filter((file) => existsSync(file));
if (packs.length === 0) {
  console.error("first_picture.mjs: there is no pack; name one with --pack, or run `npm run bench` first, which makes some");
  process.exit(2);
}

const HTML = `<!doctype html><title>first picture</title><link rel=icon href=data:,><canvas></canvas><script type=module src=page.js></script>`;
const SCRIPT = `
import { Camera, Player, load } from "./index.ts";
const search = new URLSearchParams(location.search);
const avatar = load("avatar.avatar"); // while the player starts
const player = await Player.create(document.querySelector("canvas"), { backend: search.get("backend") });
const instance = player.add(await avatar);
window.loaded = performance.now();
const { target, size } = instance.avatar.framing.whole;
const camera = new Camera();
camera.orbit(target, 2 * Math.max(...size), 0, 0, 0.6, ${SIZE}, ${SIZE});
player.frame(camera, [1, 1, 1]);
await player.finished();
window.firstPicture = performance.now();`;

const stdin = { contents: SCRIPT, resolveDir: join(HERE, "../src"), loader: "ts" };
const { outputFiles } = await bundle({ stdin, minify: true, write: false });
const own = { "/index.html": Buffer.from(HTML), "/page.js": Buffer.from(outputFiles[0].contents) };

console.log(`${MBIT_S} Mbit/s, ${LATENCY_MS} ms latency, ${SIZE}x${SIZE}, GPU in software; seconds since the page was asked for\n`);
console.log("| pack | backend | bytes | of the page | of the pack | loaded s | first picture s |");
console.log("|---|---|---|---|---|---|---|");
for (const pack of packs) {
  for (const backend of ["webgl2", "webgpu"]) await show(pack, backend);
}
process.exit(0);

async function show(pack, backend) {
  const server = await serveGzipped(pack);
  const browser = await launch();
  const page = await browser.newPage();
  const client = await page.createCDPSession();
  let bytes = 0, ofPack = 0;
  const asked = new Map();
  client.on("Network.requestWillBeSent", ({ requestId, request }) => asked.set(requestId, request.url));
  client.on("Network.loadingFinished", ({ requestId, encodedDataLength }) => {
    bytes += encodedDataLength;
    if (asked.get(requestId)?.endsWith(".avatar")) ofPack += encodedDataLength;
  });
  await client.send("Network.enable");
  await client.send("Network.emulateNetworkConditions", {
    offline: false, latency: LATENCY_MS, downloadThroughput: (MBIT_S * 1e6) / 8, uploadThroughput: (MBIT_S * 1e6) / 8,
  });
  await page.evaluateOnNewDocument(() => {
    const waiting = setInterval(() => {
      if (window.avatarViewer === undefined) return;
      clearInterval(waiting);
      window.avatarViewer.ready.then(() => (window.firstPicture = performance.now()));
    }, 5);
  });
  await page.goto(`${server.address}/index.html?backend=${backend}`);
  const shown = await page.waitForFunction(() => window.firstPicture !== undefined, { timeout: MOST_MS, polling: 100 }).catch(() => null);
  const [loaded, first] = await page.evaluate(() => [window.loaded, window.firstPicture]).catch(() => []); // a tab that crashed
  await browser.close();
  server.close();
  const seconds = (ms) => (ms === undefined ? "" : (ms / 1000).toFixed(2));
  console.log(`| ${[basename(pack), backend, bytes, bytes - ofPack, ofPack, seconds(loaded), shown ? seconds(first) : `none in ${MOST_MS / 1000}`].join(" | ")} |`);
}

/** The page and the pack; text is sent gzipped. */
async function serveGzipped(pack) {
  const types = { js: "text/javascript", html: "text/html", css: "text/css", json: "application/json", avatar: "application/octet-stream", webp: "image/webp" };
  const server = createServer(async (request, response) => {
    const path = new URL(request.url, "http://x").pathname;
    const file = options.site ? join(options.site, path) : path === "/avatar.avatar" ? pack : "";
    const body = own[path] && !options.site ? own[path] : existsSync(file) ? await readFile(file) : null;
    if (body === null) return response.writeHead(404).end();
    const kind = path.split(".").pop();
    const packed = kind === "avatar" || kind === "webp";
    const text = packed ? body : gzipSync(body, { level: 9 });
    const encoding = packed ? {} : { "Content-Encoding": "gzip" };
    response.writeHead(200, { "Content-Type": types[kind] ?? "text/plain", "Content-Length": text.length, ...encoding }).end(text);
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { address: `http://127.0.0.1:${server.address().port}`, close: () => server.close() };
}
