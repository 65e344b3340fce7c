// node build.mjs [package] [page] [tracker] [--out FOLDER]: builds the package (dist), the viewer page, and the worker that
// looks at the camera, or some of them.
//
// Page and worker lie in the Python package, or in FOLDER. Equal sources give equal bytes.
import { execFileSync } from "node:child_process";
import { copyFile, mkdir, readdir, readFile, rm, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { transform } from "esbuild";
import { SAME_BYTES, bundle, bundlePackage } from "./bundle.mjs";

const ROOT = dirname(fileURLToPath(import.meta.url));
const EXPORTER = join(ROOT, "../../exporter/avatar_export");
const BUFFER_OF_ARRAY = /\b(\w+\d+Array)<ArrayBuffer(?:Like)?>/g; // which TypeScript knows from 5.7

/** dist/NAME.js for each entry point of package.json, with shared chunks, and dist/types. */
async function buildPackage() {
  await rm(join(ROOT, "dist"), { recursive: true, force: true });
  await bundlePackage();
  const tsc = join(dirname(createRequire(import.meta.url).resolve("typescript/package.json")), "bin/tsc");
  execFileSync(process.execPath, [tsc, "-p", ROOT, "--emitDeclarationOnly", "--stripInternal"], { stdio: "inherit" });
  const types = join(ROOT, "dist/types");
  for (const name of await readdir(types, { recursive: true })) {
    if (!name.endsWith(".d.ts")) continue;
    const text = await readFile(join(types, name), "utf8");
    await writeFile(join(types, name), text.replace(BUFFER_OF_ARRAY, "$1"));
  }
}

/** index.html, viewer.js and viewer.css in a folder. */
async function buildPage(folder) {
  await mkdir(folder, { recursive: true });
  await bundle({
    ...SAME_BYTES,
    entryPoints: ["viewer/main.ts"],
    outfile: join(folder, "viewer.js"),
    format: "iife", // a module would not start in a page that is opened from a file
    minify: true,
  });
  const css = await readFile(join(ROOT, "viewer/viewer.css"), "utf8");
  const { code } = await transform(css, { loader: "css", minify: true, charset: "utf8" });
  await writeFile(join(folder, "viewer.css"), code);
  await copyFile(join(ROOT, "viewer/index.html"), join(folder, "index.html"));
}

/** tracker.js in a folder. */
async function buildTracker(folder) {
  const outfile = join(folder, "tracker.js");
  await bundle({ ...SAME_BYTES, entryPoints: ["src/visitor/worker.ts"], outfile, format: "iife", minify: true });
}

const words = process.argv.slice(2);
const at = words.indexOf("--out");
const folder = at < 0 ? null : resolve(words.splice(at, 2)[1] ?? "");
const unknown = words.find((word) => !["page", "package", "tracker"].includes(word));
if (unknown !== undefined) {
  console.error(`build.mjs: ${unknown} is neither page nor package nor tracker`);
  process.exit(2);
}
const asked = (word) => words.length === 0 || words.includes(word);
if (asked("package")) await buildPackage();
if (asked("page")) await buildPage(folder ?? join(EXPORTER, "viewer_page"));
if (asked("tracker")) await buildTracker(folder ?? join(EXPORTER, "talk"));
