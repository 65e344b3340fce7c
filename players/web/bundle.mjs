// esbuild with what this package needs: `inline-worker:FILE` imports a bundled worker as text.
import { build } from "esbuild";
import { dirname, resolve } from "node:path";

const SHARED = { bundle: true, format: "esm", target: "es2022", legalComments: "none", logLevel: "warning" };

/** A worker gets the interfaces of the shaders from the page (webgl2/start.ts), which has them already. */
const givenInterfaces = {
  name: "given-interfaces",
  setup(plugin) {
    const contents = "export const INTERFACES = globalThis.INTERFACES;";
    plugin.onLoad({ filter: /made[\\/]reflection\.ts$/ }, () => ({ contents, loader: "ts" }));
  },
};

/** A worker becomes a string, so that it needs no address of its own: also in one HTML file, and with any bundler. */
const inlineWorker = {
  name: "inline-worker",
  setup(plugin) {
    plugin.onResolve({ filter: /^inline-worker:/ }, ({ path, resolveDir }) => ({
      path: resolve(resolveDir, path.slice("inline-worker:".length)),
      namespace: "inline-worker",
    }));
    plugin.onLoad({ filter: /.*/, namespace: "inline-worker" }, async ({ path }) => {
      const options = { ...SHARED, format: "iife", entryPoints: [path], minify: true, write: false, metafile: true, plugins: [givenInterfaces] };
      const { outputFiles, metafile } = await build(options);
      const watchFiles = Object.keys(metafile.inputs).map((file) => resolve(file));
      return { contents: `export default ${JSON.stringify(outputFiles[0].text)}`, loader: "js", watchFiles, resolveDir: dirname(path) };
    });
  },
};

/** Runs esbuild; `also`: more plugins. */
export function bundle({ also = [], ...options }) {
  return build({ ...SHARED, plugins: [...also, inlineWorker], ...options });
}

/** The module that esbuild makes, in this process. */
export async function imported(options) {
  const { outputFiles } = await bundle({ write: false, platform: "neutral", ...options });
  return import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);
}
