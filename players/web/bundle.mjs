// esbuild with what this package needs: `inline-worker:FILE` imports a bundled worker as text, `light-presets:` lights by name.
import { readFile } from "node:fs/promises";
import { build } from "esbuild";
import { basename, dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const ROOT = dirname(fileURLToPath(import.meta.url));
const ENGINES = ["three", "three/*", "@babylonjs/core", "@babylonjs/core/*", "playcanvas"]; // the user's own copies
export const SAME_BYTES = { absWorkingDir: ROOT, charset: "utf8" };
const SHARED = { bundle: true, format: "esm", target: "es2022", legalComments: "none", logLevel: "warning" };

/** A worker gets the interfaces of the shaders from the page (webgl2/start_worker.ts), which has them already. */
const givenInterfaces = {
  name: "given-interfaces",
  setup(plugin) {
    plugin.onLoad({ filter: /made[\\/]reflection\.ts$/ }, () => ({ contents: "export const INTERFACES = {};", loader: "ts" }));
  },
};

/** The kernels as a text of one character a byte: gzip makes 15.7 kB of it, and 20 kB of base64. */
const plainKernels = {
  name: "plain-kernels",
  setup(plugin) {
    plugin.onLoad({ filter: /made[\\/]kernels\.ts$/ }, async ({ path }) => {
      const [, base64] = /atob\("(.*)"\)/.exec(await readFile(path, "utf8"));
      return { contents: `export const KERNELS = ${JSON.stringify(atob(base64))};`, loader: "js" };
    });
  },
};

/** One file of lights for the players and the commands. */
const lightPresets = {
  name: "light-presets",
  setup(plugin) {
    plugin.onResolve({ filter: /^light-presets:$/ }, () => ({ path: join(ROOT, "../../exporter/avatar_export/light_presets.json") }));
  },
};

/** Options for the worker as one script. */
const WORKER = { ...SHARED, format: "iife", minify: true, plugins: [givenInterfaces] };

/** A worker becomes a string, for where it has no address of its own. */
const inlineWorker = {
  name: "inline-worker",
  setup(plugin) {
    plugin.onResolve({ filter: /^inline-worker:/ }, ({ path, resolveDir }) => ({
      path: resolve(resolveDir, path.slice("inline-worker:".length)),
      namespace: "inline-worker",
    }));
    plugin.onLoad({ filter: /.*/, namespace: "inline-worker" }, async ({ path }) => {
      const { outputFiles, metafile } = await build({ ...WORKER, entryPoints: [path], write: false, metafile: true });
      const watchFiles = Object.keys(metafile.inputs).map((file) => resolve(file));
      return { contents: `export default ${JSON.stringify(outputFiles[0].text)}`, loader: "js", watchFiles, resolveDir: dirname(path) };
    });
  },
};

/** Runs esbuild; `also`: more plugins. What it makes has no worker.js beside it, unless `define` is empty. */
export function bundle({ also = [], ...options }) {
  return build({ ...SHARED, define: { "import.meta.url": '""' }, plugins: [...also, inlineWorker, lightPresets, plainKernels], ...options });
}

/** Makes dist: a script for each entry point of package.json, the chunks that they share, and worker.js. Returns esbuild's results. */
export async function bundlePackage(options) {
  const { exports } = JSON.parse(await readFile(join(ROOT, "package.json"), "utf8"));
  const names = Object.values(exports).filter((entry) => entry.types !== undefined).map((entry) => basename(entry.default, ".js"));
  const scripts = await bundle({
    ...SAME_BYTES,
    entryPoints: names.map((name) => `src/${name}.ts`),
    outdir: "dist",
    splitting: true,
    chunkNames: "chunk-[hash]",
    define: {},
    minify: true,
    external: ENGINES,
    ...options,
  });
  const worker = await build({ ...WORKER, ...SAME_BYTES, entryPoints: ["src/webgl2/worker.ts"], outfile: "dist/worker.js", ...options });
  return [scripts, worker];
}

/** The module that esbuild makes, in this process. */
export async function imported(options) {
  const { outputFiles } = await bundle({ write: false, platform: "neutral", ...options });
  return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);
}
