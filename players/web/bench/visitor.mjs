// node bench/visitor.mjs FOLDER: shows the page the film in FOLDER as a camera, and writes rows.json into it: what the page
// saw in each picture. FOLDER has film.json { fps, images } and camera.y4m, which Chromium's fake camera plays; other
// browsers (AVATAR_BROWSER) get a canvas that shows f/N.jpg. `python -m bench.visitor` makes the folder and reads the rows.
import { readdirSync } from "node:fs";
import { readFile, writeFile } from "node:fs/promises";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { bundle } from "../bundle.mjs";
import { CHROMIUM, launch, PAGE, serve } from "../tests/browser.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
const TALK = join(HERE, "../../../exporter/avatar_export/talk");
const folder = resolve(process.argv[2] ?? "");
const { fps, images } = JSON.parse(await readFile(join(folder, "film.json"), "utf8"));
const page_js = await bundle({ entryPoints: [join(HERE, "pages/visitor.ts")], write: false });
const files = { "/index.html": PAGE, "/page.js": Buffer.from(page_js.outputFiles[0].contents) };
for (const name of readdirSync(TALK)) files[`/talk/${name}`] = join(TALK, name);
if (!CHROMIUM) for (const name of readdirSync(join(folder, "f"))) files[`/f/${name}`] = join(folder, "f", name);

const camera = `--use-file-for-fake-video-capture=${join(folder, "camera.y4m")}`;
const args = CHROMIUM ? ["--use-fake-ui-for-media-stream", "--use-fake-device-for-media-stream", camera] : [];
const server = await serve(files);
const browser = await launch({ webgpu: false, args });
try {
  const page = await browser.newPage();
  await page.goto(`${server.address}/index.html`);
  await page.evaluate((...given) => window.follow(...given), fps, CHROMIUM ? 0 : images);
  const begin = Date.now();
  let state = { rows: 0, failed: "", last: 0 };
  while (state.failed === "" && state.last < images - 3 && Date.now() - begin < ((images / fps) * 3 + 60) * 1000) {
    await new Promise((done) => setTimeout(done, 500));
    state = await page.evaluate(() => {
      const { rows, failed } = window;
      return { rows: rows.length, failed, last: Math.max(0, ...rows.slice(-20).map(({ number }) => number)) };
    });
  }
  if (state.failed !== "") throw new Error(state.failed);
  await writeFile(join(folder, "rows.json"), JSON.stringify(await page.evaluate(() => window.rows)));
} finally {
  await browser.close();
  server.close();
}
