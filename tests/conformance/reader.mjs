// Plays what JavaScript can of a folder of reference vectors, through the reader that ports start from: stages activate
// and sort of every case, and every other stage by its own reference, all judged by `holds`. Standard input: JSON with
// the folder and `changes`, {tensor: {index: number}} to what is given. Standard output: JSON.
import { readFileSync } from "node:fs";
import { holds, readReference } from "../../engine_shaders/web/read_reference.mjs";

const { folder, changes } = JSON.parse(readFileSync(0, "utf8"));
const bytes = readFileSync(`${folder}/vectors.safetensors`);
const { cases, tensors } = readReference(
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
    return { order: drawn.sort((a, b) => depth[a] - depth[b] || a - b) };
  },
};

function given(name, numbers) {
  const altered = Array.from(numbers, Number);
  for (const [index, number] of Object.entries(changes[name] ?? {}))
    if (number === "end") altered.length = index;
    else altered[index] = number === "nan" ? NaN : number;
  return altered;
}

const judged = [];
for (const { name, stages } of cases) {
  for (const { stage, inputs, outputs } of stages) {
    const takes = Object.fromEntries(Object.entries(inputs).map(([k, v]) => [k, tensors[v.tensor]]));
    const gives = STAGES[stage]?.(takes) ?? {};
    const got = {};
    for (const [array, { tensor }] of Object.entries(outputs)) got[array] = given(tensor, gives[array] ?? tensors[tensor]);
    const wanted = outputs.radius && tensors[outputs.radius.tensor];
    const apart = (row) => wanted && (got.radius[row] > 0) !== (wanted[row] > 0);
    const brightest = Math.max(1, ...(takes.rgb ?? []).map(Math.abs));
    for (const [array, output] of Object.entries(outputs))
      judged.push([output.tensor, holds(output, got[array], tensors, apart, brightest)]);
  }
}
const sum = (tensor) => tensor.reduce((total, x) => total + Number(x), 0);
const sums = Object.fromEntries(Object.entries(tensors).map(([name, t]) => [name, [t.length, sum(t)]]));
process.stdout.write(JSON.stringify({ judged, sums }));
