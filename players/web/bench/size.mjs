// The bytes that a page pays for the tag, as a server sends them, gzipped: npm run size.
import { gzipSync } from "node:zlib";
import { basename } from "node:path";
import { fileURLToPath } from "node:url";
import { bundlePackage } from "../bundle.mjs";

/** Of the tag with one backend; WebAssembly is counted apart. */
export const LIMIT = 60_000;
const TAG = "src/element.ts";
const BACKENDS = { webgpu: "src/webgpu/renderer.ts", webgl2: "src/webgl2/start.ts" };
const LIFE = "src/life/life.ts", LIGHT = "src/light/part.ts";
const KERNELS = "src/made/kernels.ts";

/** Bytes of the tag before it knows its backend, of what each backend adds, of life, light and the WebAssembly, and of parts of the sources. */
export async function sizes() {
  const [scripts, worker] = await bundlePackage({ write: false, metafile: true });
  const { outputs } = scripts.metafile;
  const files = new Map(scripts.outputFiles.map(({ path, contents }) => [`dist/${basename(path)}`, gzipped(contents)]));
  const reached = (name, seen) => {
    if (seen.has(name)) return seen;
    seen.add(name);
    for (const { path, kind } of outputs[name].imports) if (kind === "import-statement") reached(path, seen);
    return seen;
  };
  const made = (entry) => Object.keys(outputs).find((name) => outputs[name].entryPoint === entry);
  const tag = reached(made(TAG), new Set());
  const kernels = Object.keys(outputs).find((name) => KERNELS in outputs[name].inputs);
  const sum = (names) => [...names].reduce((bytes, name) => bytes + files.get(name), 0);
  const added = (entry) => sum([...reached(made(entry), new Set(tag))].filter((name) => !tag.has(name) && name !== kernels));
  const found = { tag: sum(tag), life: added(LIFE), light: added(LIGHT), kernels: files.get(kernels), webgpu: added(BACKENDS.webgpu), webgl2: added(BACKENDS.webgl2) + gzipped(worker.outputFiles[0].contents) };
  const parts = {};
  for (const name of tag) for (const [source, { bytesInOutput }] of Object.entries(outputs[name].inputs)) parts[source] = bytesInOutput;
  return { ...found, parts, requests: tag.size };
}

function gzipped(bytes) {
  return gzipSync(bytes, { level: 9 }).length;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const { tag, life, light, webgpu, webgl2, kernels, parts, requests } = await sizes();
  console.log(`the tag: ${tag} bytes in ${requests} files`);
  console.log(`with WebGPU: ${tag + webgpu} (limit ${LIMIT})`);
  console.log(`with WebGL2 and its worker: ${tag + webgl2} (limit ${LIMIT}), and ${kernels} of WebAssembly`);
  console.log(`idle life, which loads after the first picture: ${life}`);
  console.log(`light, which loads with packs that can be lit: ${light}`);
  const folders = {};
  for (const [source, bytes] of Object.entries(parts)) {
    const folder = source.split("/").slice(0, -1).join("/");
    folders[folder] = (folders[folder] ?? 0) + bytes;
  }
  console.log("minified, before gzip, of the tag alone:");
  for (const [folder, bytes] of Object.entries(folders).sort((a, b) => b[1] - a[1])) console.log(`  ${folder} ${bytes}`);
  process.exitCode = tag + Math.max(webgpu, webgl2) > LIMIT ? 1 : 0;
}
