// A visitor's camera in Chromium: what is said where there is none, and a face that is followed (FACE: a film of one, y4m).
import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { after, test } from "node:test";
import { HERE, PAGE, launch, scriptOf } from "../browser.mjs";
import { createServer } from "node:http";

const TALK = join(HERE, "../../../exporter/avatar_export/talk");
const TYPES = { html: "text/html", js: "text/javascript" };
const DEVICE = ["--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream"];
const script = Buffer.from(await scriptOf("visitor"));
const asked = [];
const browsers = [];

/** Serves a page, and the tracker's files with a policy of their own below /strict/ without the model below
 * /lacking/, and none below /nowhere/. */
const server = createServer(async ({ url, headers }, response) => {
  const path = new URL(url, "http://x").pathname;
  const name = path.split("/").pop();
  asked.push(path);
  const missing = path.startsWith("/nowhere/") || (path.startsWith("/lacking/") && name.endsWith(".task"));
  const own = { "index.html": PAGE, "page.js": script, "frame.html": frame(headers.host) };
  const body = own[name] ?? (readdirSync(TALK).includes(name) && !missing ? await readFile(join(TALK, name)) : null);
  if (body === null) return response.writeHead(404).end();
  const policy = path.startsWith("/strict/") ? { "Content-Security-Policy": "script-src 'self'" } : {};
  response.writeHead(200, { "Content-Type": TYPES[name.split(".").pop()] ?? "application/octet-stream", ...policy }).end(body);
});
await new Promise((done) => server.listen(0, "127.0.0.1", done));
const { port } = server.address();

/** A page of another origin inside, which may not use the camera. */
function frame(host) {
  const other = host.startsWith("localhost") ? "127.0.0.1" : "localhost";
  return Buffer.from(`<!doctype html><iframe src="http://${other}:${port}/index.html"></iframe>`);
}

async function opened(args, address = `http://127.0.0.1:${port}/index.html`) {
  const browser = await launch({ webgpu: false, args });
  browsers.push(browser);
  const page = await browser.newPage();
  await page.goto(address);
  return page;
}

const begin = (page, options = {}) => page.evaluate((given) => window.begin(given), options);

after(async () => {
  for (const browser of browsers) await browser.close();
  server.close();
});

test("one sentence says what hinders", { timeout: 120_000 }, async () => {
  const page = await opened(DEVICE);
  assert.match(await begin(page, { files: "lacking/talk/" }), /^AvatarError: face_landmarker.task: cannot be loaded: the server answers 404/);
  assert.match(await begin(page, { files: "strict/talk/" }), /^AvatarError: the page's security policy forbids WebAssembly; add 'wasm-unsafe-eval'/);
  assert.match(await begin(page, { files: "nowhere/" }), /^AvatarError: tracker.js: cannot be loaded/);
  assert.match(await begin(page, { files: "https://example.org/talk/" }), /tracker.js: must lie on the page's own site/);
  const stopped = await page.evaluate(async () => {
    const controller = new AbortController(), { mediaDevices } = navigator;
    const open = mediaDevices.getUserMedia.bind(mediaDevices);
    let after;
    mediaDevices.getUserMedia = async (wanted) => {
      const camera = await open(wanted);
      setTimeout(() => (controller.abort(), (after = camera.getTracks()[0].readyState)));
      return camera;
    };
    return [await window.begin({ signal: controller.signal }), after];
  });
  assert.match(stopped[0], /^AbortError/);
  assert.equal(stopped[1], "ended", "while the tracker loads");
  await page.evaluate(() => (navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException("", "NotReadableError"))));
  assert.match(await begin(page), /another program may use it/);
  await page.goto(`http://127.0.0.1:${port}/frame.html`);
  const inner = await (await page.waitForSelector("iframe")).contentFrame();
  await inner.waitForFunction(() => window.begin !== undefined);
  assert.match(await begin(inner), /iframe.*allow="camera"/);
  const refused = await opened(["--use-fake-ui-for-media-stream=deny", "--use-fake-device-for-media-stream"]);
  assert.match(await begin(refused), /The camera was not allowed/);
  const none = await opened(["--use-fake-ui-for-media-stream", "--host-resolver-rules=MAP plain.test 127.0.0.1"]);
  assert.match(await begin(none), /No camera was found/);
  await none.goto(`http://plain.test:${port}/index.html`);
  assert.match(await begin(none), /https or localhost/);
});

test("a face is followed, nothing leaves the site, and the camera is given back", { timeout: 120_000, skip: !process.env.FACE && "FACE is not set" }, async () => {
  const page = await opened([...DEVICE, `--use-file-for-fake-video-capture=${process.env.FACE}`]);
  const elsewhere = [];
  page.on("request", (request) => {
    if (new URL(request.url()).port !== `${port}`) elsewhere.push(request.url());
  });
  asked.length = 0;
  assert.equal(await begin(page), "");
  assert.deepEqual([...new Set(asked)].sort(), readdirSync(TALK).filter((name) => !name.startsWith("LICENSE")).map((name) => `/talk/${name}`).sort());
  await page.waitForFunction(() => window.seen.at(-1)?.[0] === "live" && window.seen.some(([, most]) => most > 0.3), { timeout: 60_000 });
  const states = await page.evaluate(() => [...new Set(window.seen.map(([state]) => state))]);
  assert.deepEqual(states, ["learning", "live"]);
  const track = await page.evaluate(() => {
    const [camera] = window.visitor.video.srcObject.getTracks();
    window.visitor.stop();
    return camera.readyState;
  });
  assert.equal(track, "ended");
  assert.deepEqual(elsewhere, []);
});
