// The bytes that a page pays for the package: npm run size.
import { gzipSync } from "node:zlib";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { bundle, imported } from "../bundle.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
/** Of the script with its shaders, gzipped. */
export const LIMIT = 63_500;

/** Leaves the WebAssembly out, so that it is counted apart. */
const withoutKernels = {
  name: "without-kernels",
  setup(plugin) {
    plugin.onLoad({ filter: /made[\\/]kernels\.ts$/ }, () => ({ contents: 'export const KERNELS = "";', loader: "ts" }));
  },
};

/** Bytes of index.ts as a page's own bundler makes it, gzipped: the script with its shaders, and the WebAssembly. */
export async function sizes() {
  const options = { entryPoints: [join(HERE, "../src/index.ts")], minify: true, write: false };
  const script = await bundle({ ...options, also: [withoutKernels] });
  const whole = await bundle(options);
  const { KERNELS } = await imported({ entryPoints: [join(HERE, "../src/made/kernels.ts")] });
  const gzipped = (bytes) => gzipSync(bytes, { level: 9 }).length;
  return {
    script: gzipped(script.outputFiles[0].contents),
    kernels: gzipped(Buffer.from(KERNELS, "base64")),
    whole: gzipped(whole.outputFiles[0].contents),
  };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const { script, kernels, whole } = await sizes();
  console.log(`script with its shaders, minified and gzipped: ${script} bytes (limit ${LIMIT})`);
  console.log(`WebAssembly kernels, gzipped: ${kernels} bytes`);
  console.log(`both in one script, the kernels as base64, gzipped: ${whole} bytes`);
  process.exitCode = script > LIMIT ? 1 : 0;
}
