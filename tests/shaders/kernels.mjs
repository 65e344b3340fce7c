// Runs passes with the WebAssembly kernels. A job comes on standard input as JSON, {buffers, passes, read}:
//   buffers {name: {bytes, words?}}: words in base64; passes [{entry, rows, buffers: [names], constants: base64}];
//   read: names of the buffers whose contents are the answer. The answer is {exports, imports, buffers: {name: base64}}.
import { readFileSync } from "node:fs";

const text = readFileSync(new URL("../../players/web/src/made/kernels.ts", import.meta.url), "utf8");
const module = new WebAssembly.Module(Buffer.from(/KERNELS = atob\("([^"]+)"/.exec(text)[1], "base64"));
const { exports } = new WebAssembly.Instance(module, {});
const job = JSON.parse(readFileSync(0, "utf8"));

let end = exports.__heap_base.value;
function place(bytes) {
  const at = Math.ceil(end / 16) * 16;
  end = at + bytes;
  const missing = Math.ceil((end - exports.memory.buffer.byteLength) / 65536);
  if (missing > 0) exports.memory.grow(missing);
  return at;
}
const memory = () => new Uint8Array(exports.memory.buffer);

const address = {};
for (const [name, { bytes, words }] of Object.entries(job.buffers)) {
  address[name] = place(bytes);
  if (words) memory().set(Buffer.from(words, "base64"), address[name]);
}
const passes = job.passes.map(({ entry, rows, buffers, constants }) => {
  const data = Buffer.from(constants, "base64");
  const block = place(data.length);
  memory().set(data, block);
  const list = Uint32Array.from([...buffers.map((name) => address[name]), block]);
  const params = place(list.byteLength);
  new Uint32Array(exports.memory.buffer, params, list.length).set(list);
  return { entry, rows, params };
});

for (const { entry, rows, params } of passes) {
  const half = rows >> 1; // two calls, as two workers would
  exports[entry](params, 0, half);
  exports[entry](params, half, rows - half);
}
const buffers = {};
for (const name of job.read) {
  buffers[name] = Buffer.from(memory().slice(address[name], address[name] + job.buffers[name].bytes)).toString("base64");
}
const names = (list) => list.map((item) => item.name);
console.log(
  JSON.stringify({
    imports: names(WebAssembly.Module.imports(module)),
    exports: names(WebAssembly.Module.exports(module)),
    buffers,
  }),
);
