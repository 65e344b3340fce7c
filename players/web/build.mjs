// node build.mjs [package] [page] [--out FOLDER]: builds the package (dist) and the viewer page, or one of them.
//
// The page lies in the Python package, or in FOLDER. Equal sources give equal bytes.
import { execFileSync } from "node:child_process";
import { copyFile, mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { basename, dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { transform } from "esbuild";
import { bundle } from "./bundle.mjs";

const ROOT = dirname(fileURLToPath(import.meta.url));
const PAGE = join(ROOT, "../../exporter/avatar_export/viewer_page");
const ENGINES = ["three", "three/*", "@babylonjs/core", "@babylonjs/core/*", "playcanvas"]; // the user's own copies
const SAME_BYTES = { absWorkingDir: ROOT, charset: "utf8" };

/** dist/NAME.js for each entry point of package.json, with shared chunks, and dist/types. */
async function buildPackage() {
  const { exports } = JSON.parse(await readFile(join(ROOT, "package.json"), "utf8"));
  const names = Object.values(exports).map((entry) => basename(entry.default, ".js"));
  await rm(join(ROOT, "dist"), { recursive: true, force: true });
  await bundle({
    ...SAME_BYTES,
    entryPoints: names.map((name) => `src/${name}.ts`),
    outdir: "dist",
    splitting: true,
    chunkNames: "chunk-[hash]",
    minifySyntax: true,
    minifyWhitespace: true,
    external: ENGINES,
  });
  const tsc = join(dirname(createRequire(import.meta.url).resolve("typescript/package.json")), "bin/tsc");
  execFileSync(process.execPath, [tsc, "-p", ROOT, "--emitDeclarationOnly"], { stdio: "inherit" });
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

const words = process.argv.slice(2);
const at = words.indexOf("--out");
const folder = at < 0 ? PAGE : resolve(words.splice(at, 2)[1] ?? "");
const unknown = words.find((word) => word !== "page" && word !== "package");
if (unknown !== undefined) {
  console.error(`build.mjs: ${unknown} is neither page nor package`);
  process.exit(2);
}
if (words.length === 0 || words.includes("package")) await buildPackage();
if (words.length === 0 || words.includes("page")) await buildPage(folder);
