// The rigid fit of one set of points to another (Kabsch): least squares, no reflection.
// The rotation is that of the quaternion that Horn's symmetric 4x4 matrix stretches most, found by Jacobi's method.
// B. K. P. Horn, "Closed-form solution of absolute orientation using unit quaternions", JOSA A 4, 1987.

import { setFromQuat } from "./affine.js";
import { eigen } from "./eigen.js";

const MATRIX = new Float64Array(16);
const VECTORS = new Float64Array(16);
const MEAN = new Float64Array(3); // of the points `to`

/**
 * Writes the rigid transform [3, 4] that takes points `from` to points `to` ([A, 3] each) with `weights` [A] best.
 * `centre` [3] is the weighted mean of `from`.
 */
export function rigidFit(
  out: Float64Array,
  from: Float64Array,
  to: Float64Array,
  weights: Float64Array,
  centre: Float64Array,
): void {
  setMean(MEAN, to, weights);
  setHorn(from, to, weights, centre);
  setFromQuat(out, 0, VECTORS, 4 * eigen(MATRIX, VECTORS, 4));
  const x = centre[0] as number, y = centre[1] as number, z = centre[2] as number;
  for (let c = 0, row = 0; c < 3; c++, row += 4) {
    const turned = (out[row] as number) * x + (out[row + 1] as number) * y + (out[row + 2] as number) * z;
    out[row + 3] = (MEAN[c] as number) - turned;
  }
}

/** The weighted mean [3] of points [A, 3]. */
export function setMean(out: Float64Array, points: Float64Array, weights: Float64Array): void {
  let sum = 0;
  out.fill(0);
  for (let i = 0; i < weights.length; i++) {
    const weight = weights[i] as number;
    sum += weight;
    for (let c = 0; c < 3; c++) out[c] = (out[c] as number) + weight * (points[3 * i + c] as number);
  }
  for (let c = 0; c < 3; c++) out[c] = (out[c] as number) / sum;
}

/** MATRIX = Horn's matrix of the covariance of both sets of points about their means. */
function setHorn(from: Float64Array, to: Float64Array, weights: Float64Array, centre: Float64Array): void {
  const cx = centre[0] as number, cy = centre[1] as number, cz = centre[2] as number;
  const tx = MEAN[0] as number, ty = MEAN[1] as number, tz = MEAN[2] as number;
  let xx = 0, xy = 0, xz = 0, yx = 0, yy = 0, yz = 0, zx = 0, zy = 0, zz = 0;
  for (let i = 0; i < weights.length; i++) {
    const weight = weights[i] as number;
    const ax = weight * ((from[3 * i] as number) - cx);
    const ay = weight * ((from[3 * i + 1] as number) - cy);
    const az = weight * ((from[3 * i + 2] as number) - cz);
    const bx = (to[3 * i] as number) - tx, by = (to[3 * i + 1] as number) - ty, bz = (to[3 * i + 2] as number) - tz;
    xx += ax * bx, xy += ax * by, xz += ax * bz;
    yx += ay * bx, yy += ay * by, yz += ay * bz;
    zx += az * bx, zy += az * by, zz += az * bz;
  }
  const m = MATRIX;
  m[0] = xx + yy + zz;
  m[1] = m[4] = yz - zy;
  m[2] = m[8] = zx - xz;
  m[3] = m[12] = xy - yx;
  m[5] = xx - yy - zz;
  m[6] = m[9] = xy + yx;
  m[7] = m[13] = zx + xz;
  m[10] = yy - xx - zz;
  m[11] = m[14] = yz + zy;
  m[15] = zz - xx - yy;
}
