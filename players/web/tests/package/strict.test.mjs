// Pages with a Content-Security-Policy, and what is said where one forbids too much.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { CHROMIUM, PAGE, launch, notHere, serve } from "../browser.mjs";
import { PACKAGE, built } from "./package.mjs";

const README = readFileSync(join(PACKAGE, "README.md"), "utf8");
/** The header that README.md names; the page has its icon as data. */
const STRICT = /^Content-Security-Policy: (.*)$/m.exec(README)[1].replace("img-src", "img-src data:");
const WITHOUT_WASM = STRICT.replace(" 'wasm-unsafe-eval'", "");
const WITHOUT_WORKERS = STRICT.replace("worker-src 'self'", "worker-src 'none'");
const WAIT_MS = 120_000;

/** Draws the sample, and gives the alpha of its pixels. */
const PLAYER = `
  const { Camera, Player, load } = await import("./player/index.js");
  const player = await Player.create(document.createElement("canvas"), { backend: BACKEND });
  const avatar = await load(ADDRESS);
  player.add(avatar);
  const camera = new Camera();
  camera.orbit(avatar.framing.whole.target, 0.6, 0, 0, 0.5, 64, 64);
  player.frame(camera, null);
  await player.finished();
  return (await player.readPixels()).filter((_, i) => i % 4 === 3);`;
/** The same with the tag. */
const TAG = `
  await import("./player/element.js");
  const element = document.createElement("gaussian-avatar");
  Object.assign(element, { src: ADDRESS, backend: BACKEND });
  element.style.width = "64px";
  document.body.append(element);
  await new Promise((done, fail) => {
    element.addEventListener("load", done);
    element.addEventListener("error", (event) => fail(event.error));
  });
  const image = await createImageBitmap(await element.toBlob());
  const context = new OffscreenCanvas(64, 64).getContext("2d");
  context.drawImage(image, 0, 0, 64, 64);
  return Array.from(context.getImageData(0, 0, 64, 64).data).filter((_, i) => i % 4 === 3).map((value) => value / 255);`;
/** Posts what was seen: which part of the image is covered, what was refused. */
const SCRIPT = `
  const refused = [];
  document.addEventListener("securitypolicyviolation", (event) => refused.push(event.violatedDirective + " " + event.blockedURI));
  const answer = { name: "", said: "", covered: 0, refused };
  try {
    const alpha = await (async () => {DRAW})();
    answer.covered = alpha.filter((value) => value > 0.5).length / alpha.length;
  } catch (error) {
    Object.assign(answer, { name: error.name, said: error.message });
  }
  await fetch("/out/answer", { method: "POST", body: JSON.stringify(answer) });`;

let browser;
before(async () => (browser = await launch()));
after(() => browser?.close());

/** What the page's script posts. */
async function answerOf({ policy, draw = PLAYER, backend = "webgl2", address = "player/sample.avatar", without }) {
  const script = SCRIPT.replace("DRAW", draw).replace("BACKEND", JSON.stringify(backend)).replace("ADDRESS", JSON.stringify(address));
  const files = { ...built("/player"), "/index.html": PAGE, "/page.js": Buffer.from(script) };
  delete files[without];
  const server = await serve(files, policy);
  const page = await browser.newPage();
  await page.goto(`${server.address}/index.html`);
  for (const end = Date.now() + WAIT_MS; !server.written.has("answer") && Date.now() < end; ) await new Promise((done) => setTimeout(done, 50));
  await page.close();
  server.close();
  return JSON.parse(server.written.get("answer"));
}

for (const [what, draw] of Object.entries({ player: PLAYER, tag: TAG })) {
  test(`a strict page shows the avatar by the ${what}, and nothing is refused`, async () => {
    const { covered, refused, said } = await answerOf({ policy: STRICT, draw });
    assert.equal(said, "");
    assert.deepEqual(refused, []);
    assert.ok(covered > 0.1 && covered < 0.9, `${covered}`);
  });
}

test("with WebGPU a page needs no WebAssembly", { skip: notHere }, async () => {
  const { covered, refused, said } = await answerOf({ policy: WITHOUT_WASM, backend: "webgpu" });
  assert.deepEqual([said, refused], ["", []]);
  assert.ok(covered > 0.1, `${covered}`);
});

test("a policy that forbids WebAssembly or workers is named", async () => {
  const wasm = await answerOf({ policy: WITHOUT_WASM });
  assert.equal(wasm.name, "AvatarError", wasm.said);
  assert.match(wasm.said, /^WebGL2: this page's Content-Security-Policy forbids WebAssembly.* add 'wasm-unsafe-eval' to its script-src$/);
  const workers = await answerOf({ policy: WITHOUT_WORKERS });
  assert.equal(workers.name, "AvatarError", workers.said);
  assert.match(workers.said, /^WebGL2: the worker cannot start .*worker-src/);
});

test("where a bundler left worker.js out, a text takes its place", async () => {
  const { covered, said } = await answerOf({ without: "/player/worker.js" });
  assert.equal(said, "");
  assert.ok(covered > 0.1, `${covered}`);
});

test("an address that answers an HTML page is named as that", async () => {
  const { name, said } = await answerOf({ address: "index.html?head.avatar" });
  assert.equal(name, "AvatarError");
  assert.match(said, /answers an HTML page, not this file; is the address right\?$/);
});
