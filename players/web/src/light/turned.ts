// Ambient light, seen from an avatar that the scene has turned.

import { SH_C1, SH_C2 } from "../made/constants.js";
import { polar } from "../pose/affine.js";

const STEPS = 8; // of Newton's method: a scale of 4 across to along is gone
const TURN = new Float64Array(12); // scene from pack: orthogonal, it may mirror; rows four apart
const FORM = new Float64Array(9); // the second band as a symmetric matrix
const HALF = new Float64Array(9);
const VECTOR = new Float64Array(3); // the first band

/** Keeps the turn of `place` [4, 4] for `turned`; returns how much it scales. */
export function setTurn(place: Float64Array): number {
  const a = place[0] as number, b = place[1] as number, c = place[2] as number;
  const d = place[4] as number, e = place[5] as number, f = place[6] as number;
  const g = place[8] as number, h = place[9] as number, k = place[10] as number;
  const scale = Math.cbrt(Math.abs(a * (e * k - f * h) - b * (d * k - f * g) + c * (d * h - e * g)));
  for (let i = 0; i < 12; i++) TURN[i] = (place[i] as number) / scale;
  polar(TURN, 0, STEPS);
  return scale;
}

/** Writes nine float4 from out[at] on: `ambient` [9, 3] of normals in the pack's space, by the turn that is kept. */
export function turned(out: Float32Array, at: number, ambient: Float64Array): void {
  for (let c = 0; c < 3; c++) {
    out[at + c] = ambient[c] as number;
    turnVector(out, at + c, ambient, c);
    turnForm(out, at + c, ambient, c);
  }
  for (let k = 0; k < 9; k++) out[at + 4 * k + 3] = 0;
}

/** Terms 1 to 3 of one channel: factors of y, z, x. */
function turnVector(out: Float32Array, at: number, ambient: Float64Array, channel: number): void {
  for (let term = 0; term < 3; term++) VECTOR[(term + 1) % 3] = (SH_C1[term] as number) * (ambient[3 * (term + 1) + channel] as number);
  for (let term = 0; term < 3; term++) {
    const axis = (term + 1) % 3;
    let sum = 0;
    for (let i = 0; i < 3; i++) sum += (TURN[4 * i + axis] as number) * (VECTOR[i] as number);
    out[at + 4 * (term + 1)] = sum / (SH_C1[term] as number);
  }
}

/** Terms 4 to 8 of one channel: factors of xy, yz, 2zz-xx-yy, xz, xx-yy. */
function turnForm(out: Float32Array, at: number, ambient: Float64Array, channel: number): void {
  const along = scaled(ambient, channel, 2), across = scaled(ambient, channel, 4);
  FORM[0] = across - along;
  FORM[4] = -across - along;
  FORM[8] = 2 * along;
  FORM[1] = FORM[3] = scaled(ambient, channel, 0) / 2;
  FORM[5] = FORM[7] = scaled(ambient, channel, 1) / 2;
  FORM[2] = FORM[6] = scaled(ambient, channel, 3) / 2;
  for (let i = 0; i < 9; i++) HALF[i] = product(FORM, 3 * ((i / 3) | 0), 1, TURN, i % 3, 4); // F T
  for (let i = 0; i < 9; i++) FORM[i] = product(TURN, (i / 3) | 0, 4, HALF, i % 3, 3); // T^t F T
  out[at + 16] = (2 * (FORM[1] as number)) / (SH_C2[0] as number);
  out[at + 20] = (2 * (FORM[5] as number)) / (SH_C2[1] as number);
  out[at + 24] = (FORM[8] as number) / 2 / (SH_C2[2] as number);
  out[at + 28] = (2 * (FORM[2] as number)) / (SH_C2[3] as number);
  out[at + 32] = ((FORM[0] as number) - (FORM[4] as number)) / 2 / (SH_C2[4] as number);
}

/** Of one channel, term k of the second band as a factor of its polynomial. */
function scaled(ambient: Float64Array, channel: number, k: number): number {
  return (SH_C2[k] as number) * (ambient[3 * (4 + k) + channel] as number);
}

/** The sum of three products, of numbers that lie `s` apart in a and `t` apart in b. */
function product(a: Float64Array, i: number, s: number, b: Float64Array, j: number, t: number): number {
  return (
    (a[i] as number) * (b[j] as number) +
    (a[i + s] as number) * (b[j + t] as number) +
    (a[i + 2 * s] as number) * (b[j + 2 * t] as number)
  );
}
