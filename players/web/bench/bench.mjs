// CPU time a frame of this package and of other renderers, on WebGL2 in software, interleaved.
//
//   npm run bench -- [--lam FILE] [--samples FOLDER] [--rounds N] [--frames N] [--only NAME,NAME] [--python PROGRAM]
//
// It needs Linux, Chromium, the project's Python and, once, the npm registry. --lam is a LAM avatar's zip; without it
// those rows are left out. Each renderer has a browser of its own; in each round every browser draws the same frames of
// the same Gaussians at the same size and camera while the others wait. The number is user and system time of the whole
// process tree of a browser, divided by frames; the table gives the median of the rounds.
import { execFileSync } from "node:child_process";
import { existsSync } from "node:fs";
import { mkdir, readFile } from "node:fs/promises";
import { loadavg } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { bundle, imported } from "../bundle.mjs";
import { PAGE, launch, open, serve } from "../tests/browser.mjs";
import { installPeers } from "./peers.mjs";
import { treeSeconds } from "./processes.mjs";

const SIZE = 512; // pixels
const FOV_Y = 0.5; // radians
const WARM_FRAMES = 3;
const FLAGS = ["--use-gl=angle", "--use-angle=swiftshader"];
const HERE = dirname(fileURLToPath(import.meta.url));
const BUILD = join(HERE, "../build/bench");
const REPOSITORY = join(HERE, "../../..");

// LAM's renderer imports a debugging aid from a web site when it starts; the benchmark leaves it out.
const FROM_WEB = /import\s*"https:[^"]*";/g;

// target: what is blended into; cutOff: what a splat leaves out.
const RENDERERS = {
  "ours": { page: "ours.ts", form: "avatar", moves: "pose and camera", target: "RGBA32F", cutOff: "alpha < 1/255" },
  "ours, still pose": { page: "ours.ts", query: "?still", form: "avatar", moves: "camera", target: "RGBA32F", cutOff: "alpha < 1/255" },
  "the element": { page: "tag.ts", form: "avatar", moves: "camera", target: "RGBA32F", cutOff: "alpha < 1/255" },
  "the element, idle life": { page: "tag.ts", query: "?idle", form: "avatar", moves: "pose and camera", target: "RGBA32F", cutOff: "alpha < 1/255" },
  "Spark 2.2.0": { page: "spark.js", form: "ply", moves: "camera", target: "RGBA8", cutOff: "alpha < 1/255, 2.83 sigma" },
  "PlayCanvas 2.23.3": { page: "playcanvas.js", form: "ply", moves: "camera", target: "RGBA8", cutOff: "alpha < 1/255, 2.83 sigma" },
  "gsplat.js 1.2.9": { page: "gsplat.js", form: "ply", moves: "camera", target: "RGBA8", cutOff: "2.83 sigma" },
  "mkkellogg's 0.4.7": { page: "mkkellogg.js", form: "ply", moves: "camera", target: "RGBA8", cutOff: "2.83 sigma" },
  "LAM's own 0.0.8": { page: "lam.js", form: "zip", moves: "pose and camera", target: "RGBA8", cutOff: "alpha < 1/255, quad of 2.83 sigma" },
};

// Packages of a peer's page are those of the peers' folder, and not those that this package is developed with.
const fromPeers = {
  name: "peers",
  setup(plugin) {
    plugin.onResolve({ filter: /^[@\w]/ }, ({ path, kind, pluginData }) => {
      if (kind === "entry-point" || pluginData === fromPeers || path.startsWith("https:")) return undefined;
      return plugin.resolve(path, { resolveDir: join(BUILD, "peers"), kind, pluginData: fromPeers });
    });
  },
};

const { values: options } = parseArgs({
  options: {
    lam: { type: "string" },
    samples: { type: "string" },
    rounds: { type: "string", default: "5" },
    frames: { type: "string", default: "12" },
    only: { type: "string" },
    python: { type: "string", default: join(REPOSITORY, ".venv/bin/python") },
  },
});

const avatars = await makeAvatars();
await installPeers(join(BUILD, "peers"));
console.log(`Load of the machine before: ${load()}. CPU ms a frame, ${SIZE}x${SIZE}, WebGL2 on SwiftShader,`);
console.log(`median of ${options.rounds} rounds of ${options.frames} frames (least to most).\n`);
console.log("| avatar | renderer | changes | CPU ms | wall ms | covered | target | cut-off |");
console.log("|---|---|---|---|---|---|---|---|");
for (const avatar of avatars) await compare(avatar);
console.log(`\nLoad of the machine after: ${load()}.`);
process.exit(0);

/** Packs and PLYs, made once. */
async function makeAvatars() {
  const folder = join(BUILD, "avatars");
  const names = ["head", ...(options.lam ? ["lam"] : [])];
  if (!names.every((name) => existsSync(join(folder, `${name}.ply`)))) {
    const args = ["-m", "bench.web_avatars", folder];
    if (options.samples) args.push("--samples", options.samples);
    if (options.lam) args.push("--lam", options.lam);
    execFileSync(options.python, args, { cwd: REPOSITORY, stdio: "inherit" });
  }
  const forms = (name) => ({ avatar: join(folder, `${name}.avatar`), ply: join(folder, `${name}.ply`) });
  const made = [{ name: "sample head, 70,000", files: forms("head") }];
  if (options.lam) made.push({ name: "LAM, 20,018", files: { ...forms("lam"), zip: options.lam } });
  return made;
}

async function compare({ name, files }) {
  const setup = { size: SIZE, fovY: FOV_Y, ...(await viewOf(files.avatar)) };
  const running = [];
  for (const [title, renderer] of Object.entries(RENDERERS)) {
    if (files[renderer.form] === undefined || (options.only && !options.only.split(",").includes(renderer.page))) continue;
    running.push({ title, renderer, times: [], walls: [], ...(await start(renderer, files, setup)) });
  }
  for (let round = 0; round < Number(options.rounds); round++) {
    for (const one of running) await measure(one, round);
  }
  await mkdir(join(BUILD, "pictures"), { recursive: true });
  for (const { title, renderer, times, walls, page, browser, server, errors } of running) {
    const covered = await page.evaluate(() => window.covered());
    await page.screenshot({ path: join(BUILD, "pictures", `${name} ${title}.png`.replace(/[^\w.]+/g, "_")) });
    await browser.close();
    server.close();
    if (errors.length > 0) console.log(`${title}: ${errors[0]}`);
    const cpu = `${median(times).toFixed(0)} (${Math.min(...times).toFixed(0)} to ${Math.max(...times).toFixed(0)})`;
    const cells = [name, title, renderer.moves, cpu, median(walls).toFixed(0), `${(100 * covered).toFixed(1)}%`];
    console.log(`| ${[...cells, renderer.target, renderer.cutOff].join(" | ")} |`);
  }
}

/** Where to look, from the pack: the head if it has one. */
async function viewOf(file) {
  const { load } = await imported({ entryPoints: [join(HERE, "../src/load.ts")] });
  const { framing } = await load(new Uint8Array(await readFile(file)));
  const { target, size } = framing.head ?? framing.whole;
  return { target, distance: (0.55 * Math.max(size[0], size[1])) / Math.tan(FOV_Y / 2) };
}

async function start(renderer, files, setup) {
  const entryPoints = [join(HERE, "pages", renderer.page)];
  const foreign = renderer.form === "avatar" ? {} : { also: [fromPeers], external: ["https://*"] };
  const built = await bundle({ entryPoints, write: false, ...foreign });
  const script = built.outputFiles[0].text.replace(FROM_WEB, "");
  const file = files[renderer.form];
  const address = `/avatar.${renderer.form}`;
  const server = await serve({ "/index.html": PAGE, "/page.js": Buffer.from(script), [address]: file });
  const browser = await launch({ webgpu: false, args: FLAGS });
  const { page, errors } = await open(browser, `${server.address}/index.html${renderer.query ?? ""}`);
  await page.setViewport({ width: SIZE, height: SIZE });
  await page.addStyleTag({ content: "body { margin: 0 }" });
  await page.evaluate((given) => window.start(given), { ...setup, url: `${server.address}${address}` });
  return { browser, page, server, errors };
}

async function measure({ browser, page, times, walls }, round) {
  const frames = Number(options.frames);
  const run = (first, count) =>
    page.evaluate(async (from, n) => {
      for (let i = from; i < from + n; i++) await window.step(i);
    }, first, count);
  const first = round * (frames + WARM_FRAMES);
  await run(first, WARM_FRAMES);
  const root = browser.process().pid;
  const [cpu, wall] = [treeSeconds(root), performance.now()];
  await run(first + WARM_FRAMES, frames);
  walls.push((performance.now() - wall) / frames);
  times.push((1000 * (treeSeconds(root) - cpu)) / frames);
}

function median(numbers) {
  const sorted = [...numbers].sort((a, b) => a - b);
  return (sorted[(sorted.length - 1) >> 1] + sorted[sorted.length >> 1]) / 2;
}

function load() {
  return loadavg().map((one) => one.toFixed(1)).join(" ");
}
