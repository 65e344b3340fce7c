// Plays what JavaScript can of a folder of reference vectors, through the reader that ports start from: stages activate
// and sort of every case, judged by the stated tolerances. Standard input: the folder. Standard output: JSON.
import { readFileSync } from "node:fs";
import { readReference, toleranceUsed } from "../../engine_shaders/web/read_reference.mjs";

const folder = readFileSync(0, "utf8").trim();
const bytes = readFileSync(`${folder}/vectors.safetensors`);
const reference = readReference(
  readFileSync(`${folder}/cases.json`, "utf8"),
  bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length),
);

const STAGES = {
  activate({ log_scale, quat_wxyz, opacity_logit }) {
    const length = (row) => Math.hypot(...quat_wxyz.subarray(4 * row, 4 * row + 4));
    return {
      scale: Float32Array.from(log_scale, Math.exp),
      quat_wxyz: quat_wxyz.map((q, i) => q / Math.max(length(Math.floor(i / 4)), 1e-12)),
      opacity: opacity_logit.map((x) => 1 / (1 + Math.exp(-x))),
    };
  },
  sort({ depth, radius }) {
    const drawn = [...depth.keys()].filter((id) => radius[id] > 0);
    const order = drawn.sort((a, b) => depth[a] - depth[b] || a - b);
    return { order: order.map(BigInt) };
  },
};

// Tolerance used; 2 where an order differs anywhere, since its key is given to the bit.
function share(stage, output, got) {
  const want = reference.tensors[output.tensor];
  if (got.length !== want.length) return null;
  return stage === "sort" ? 2 * got.some((id, i) => id !== want[i]) : toleranceUsed(output, got, reference.tensors);
}

const used = [];
for (const { name, stages } of reference.cases) {
  for (const { stage, inputs, outputs } of stages.filter((s) => s.stage in STAGES)) {
    const given = Object.fromEntries(Object.entries(inputs).map(([k, v]) => [k, reference.tensors[v.tensor]]));
    const got = STAGES[stage](given);
    for (const [array, output] of Object.entries(outputs)) used.push([name, stage, array, share(stage, output, got[array])]);
  }
}
const sum = (tensor) => tensor.reduce((total, x) => total + Number(x), 0);
const sums = Object.fromEntries(Object.entries(reference.tensors).map(([name, t]) => [name, [t.length, sum(t)]]));
process.stdout.write(JSON.stringify({ used, sums }));
