// Compares an output with the reference, element by element, as avatar_runtime/conformance/judge.py does.

import type { Expected, Numbers, Step, Tensors } from "./reference.js";

const FLIP_STEP = 4e-3; // of the brightest colour: what a pixel may be off at the cut-off of alpha

/** How far one array lies from its reference. */
export interface Verdict {
  readonly error: number; // largest absolute difference, without flips
  readonly used: number; // largest share of the tolerance; 1 is the most that passes
  readonly flips: number; // rows on the other side of a threshold
  readonly passed: boolean;
}

/** A verdict for each output of a step, by array. */
export function judge(step: Step, got: Tensors, tensors: Tensors): Record<string, Verdict> {
  const apart = drawnInOne(step, got, tensors);
  const rgb = step.inputs["rgb"];
  const brightest = rgb === undefined ? 1 : Math.max(1, ...Array.from(tensors[rgb.tensor] as Float32Array, Math.abs));
  const verdicts: Record<string, Verdict> = {};
  for (const [name, expected] of Object.entries(step.outputs)) {
    verdicts[name] = verdict(expected, got[name], tensors, apart, brightest);
  }
  return verdicts;
}

/** Rows that either side alone draws. */
function drawnInOne(step: Step, got: Tensors, tensors: Tensors): Uint8Array | null {
  const radius = step.outputs["radius"];
  if (radius === undefined) return null;
  const want = tensors[radius.tensor] as Int32Array;
  const have = got["radius"] as Int32Array;
  return Uint8Array.from(want, (r, i) => (r > 0 !== (have[i] as number) > 0 ? 1 : 0));
}

function verdict(expected: Expected, got: Numbers | undefined, tensors: Tensors, apart: Uint8Array | null, brightest: number): Verdict {
  const want = tensors[expected.tensor] as Numbers;
  if (got === undefined || got.length !== want.length) return { error: Infinity, used: Infinity, flips: 0, passed: false };
  const rows = expected.shape[0] ?? 1;
  const width = rows === 0 ? 0 : want.length / rows;
  const weight = expected.weight === undefined ? null : (tensors[expected.weight.tensor] as Float32Array);
  let error = 0, used = 0, flips = 0;
  for (let row = 0; row < rows; row++) {
    if (expected.flips !== "drawn" && apart?.[row] === 1) continue;
    const allowed = expected.atol * (weight?.[row] ?? 1);
    let best = compared(got, want, row, width, allowed, expected.rtol, 1);
    if (expected.flips === "sign") {
      const other = compared(got, want, row, width, allowed, expected.rtol, -1);
      if (other.used < best.used) best = other;
    }
    if (best.used > 1 && flipped(expected, got, want, row, best.error, brightest)) flips++;
    else {
      error = Math.max(error, best.error);
      used = Math.max(used, best.used);
    }
  }
  return { error, used, flips, passed: used <= 1 && flips <= (expected.most_flips ?? 0) };
}

function flipped(expected: Expected, got: Numbers, want: Numbers, row: number, error: number, brightest: number): boolean {
  if (expected.flips === "shadow") return true; // a texel or a Gaussian on the other side of an edge
  if (expected.flips === "drawn") return error === 1 || Number(got[row]) === 0 || Number(want[row]) === 0;
  return expected.flips === "cutoff" && error <= FLIP_STEP * brightest;
}

function compared(got: Numbers, want: Numbers, row: number, width: number, atol: number, rtol: number, sign: number): { error: number; used: number } {
  let error = 0, used = 0;
  for (let i = row * width; i < (row + 1) * width; i++) {
    const w = Number(want[i]);
    const off = Math.abs(sign * Number(got[i]) - w);
    const allowed = atol + rtol * Math.abs(w);
    if (!(off <= allowed)) used = Math.max(used, off === off && allowed > 0 ? off / allowed : Infinity);
    else if (allowed > 0) used = Math.max(used, off / allowed);
    error = off > error || off !== off ? off : error;
  }
  return { error, used };
}
