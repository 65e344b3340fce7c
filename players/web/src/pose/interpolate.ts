import { type Floats, quatFromMatrix, setFromQuat } from "./affine.js";

const FIRST = new Float64Array(12); // rotation of a matrix
const SECOND = new Float64Array(12);
const REST_FIRST = new Float64Array(6); // what remains: upper triangular
const REST_SECOND = new Float64Array(6);
const TURN = new Float64Array(12);
const QUATS = new Float64Array(8);

/**
 * Writes an affine matrix [4, 4] at out[o]: `parts` [2] of the one at m[a] and of the one at n[b].
 * Equal matrices, and a second part of 0, give the first one's numbers.
 */
export function interpolate(
  out: Float64Array, o: number, m: Floats, a: number, n: Floats, b: number, parts: Float64Array,
): void {
  let same = parts[1] === 0;
  if (!same) {
    same = true;
    for (let k = 0; k < 12 && same; k++) same = m[a + k] === n[b + k];
  }
  for (let k = 0; k < 16; k++) out[o + k] = m[a + k] as number;
  if (!same) mix(out, o, m, a, n, b, parts);
}

function mix(out: Float64Array, o: number, m: Floats, a: number, n: Floats, b: number, parts: Float64Array): void {
  split(FIRST, REST_FIRST, m, a);
  split(SECOND, REST_SECOND, n, b);
  turn(parts);
  const u = REST_FIRST, v = REST_SECOND, r = TURN, keep = parts[0] as number, part = parts[1] as number;
  const xx = keep * (u[0] as number) + part * (v[0] as number);
  const xy = keep * (u[1] as number) + part * (v[1] as number);
  const xz = keep * (u[2] as number) + part * (v[2] as number);
  const yy = keep * (u[3] as number) + part * (v[3] as number);
  const yz = keep * (u[4] as number) + part * (v[4] as number);
  const zz = keep * (u[5] as number) + part * (v[5] as number);
  for (let row = 0; row < 12; row += 4) {
    const x = r[row] as number, y = r[row + 1] as number, z = r[row + 2] as number;
    out[o + row] = x * xx;
    out[o + row + 1] = x * xy + y * yy;
    out[o + row + 2] = x * xz + y * yz + z * zz;
    out[o + row + 3] = keep * (m[a + row + 3] as number) + part * (n[b + row + 3] as number);
  }
}

/** TURN = the rotation between FIRST and SECOND: quaternions mixed the short way, then normalised. */
function turn(parts: Float64Array): void {
  const q = QUATS, keep = parts[0] as number, part = parts[1] as number;
  quatFromMatrix(q, 0, FIRST, 0);
  quatFromMatrix(q, 4, SECOND, 0);
  let dot = 0;
  for (let k = 0; k < 4; k++) dot += (q[k] as number) * (q[4 + k] as number);
  const other = dot < 0 ? -part : part;
  let square = 0;
  for (let k = 0; k < 4; k++) {
    q[k] = keep * (q[k] as number) + other * (q[4 + k] as number);
    square += (q[k] as number) ** 2;
  }
  const scale = 1 / Math.sqrt(square);
  for (let k = 0; k < 4; k++) q[k] = (q[k] as number) * scale;
  setFromQuat(TURN, 0, q, 0);
}

/** m = rotation rest, by Gram-Schmidt on the columns. `rest` is xx, xy, xz, yy, yz, zz; zz is negative for a mirror. */
function split(rotation: Float64Array, rest: Float64Array, m: Floats, at: number): void {
  const r = rotation;
  const ax = m[at] as number, ay = m[at + 4] as number, az = m[at + 8] as number;
  const bx = m[at + 1] as number, by = m[at + 5] as number, bz = m[at + 9] as number;
  const cx = m[at + 2] as number, cy = m[at + 6] as number, cz = m[at + 10] as number;
  const xx = Math.sqrt(ax * ax + ay * ay + az * az);
  const ux = ax / xx, uy = ay / xx, uz = az / xx;
  const xy = ux * bx + uy * by + uz * bz;
  const dx = bx - xy * ux, dy = by - xy * uy, dz = bz - xy * uz;
  const yy = Math.sqrt(dx * dx + dy * dy + dz * dz);
  const vx = dx / yy, vy = dy / yy, vz = dz / yy;
  const wx = uy * vz - uz * vy, wy = uz * vx - ux * vz, wz = ux * vy - uy * vx;
  r[0] = ux, r[1] = vx, r[2] = wx;
  r[4] = uy, r[5] = vy, r[6] = wy;
  r[8] = uz, r[9] = vz, r[10] = wz;
  rest[0] = xx;
  rest[1] = xy;
  rest[2] = ux * cx + uy * cy + uz * cz;
  rest[3] = yy;
  rest[4] = vx * cx + vy * cy + vz * cz;
  rest[5] = wx * cx + wy * cy + wz * cz;
}
