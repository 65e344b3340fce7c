// Affine transforms as 12 numbers, rows of a [3, 4] matrix for column vectors, at an offset of an array. No allocation:
// numbers come in arrays, since JavaScript may box a fraction that is handed to a function.

/** Any array of floats. */
export type Floats = Float64Array | Float32Array;

const RIGHT = new Float64Array(12);

/** out = a b. `out` may be `a` or `b`. The rows of b are `stride` numbers apart: 4 in both [3, 4] and [4, 4]. */
export function multiply(out: Floats, o: number, a: Floats, i: number, b: Floats, j: number): void {
  const r = RIGHT;
  for (let k = 0; k < 12; k++) r[k] = b[j + k] as number;
  for (let row = 0; row < 3; row++) {
    const x = a[i + 4 * row] as number;
    const y = a[i + 4 * row + 1] as number;
    const z = a[i + 4 * row + 2] as number;
    const t = a[i + 4 * row + 3] as number;
    const at = o + 4 * row;
    out[at] = x * (r[0] as number) + y * (r[4] as number) + z * (r[8] as number);
    out[at + 1] = x * (r[1] as number) + y * (r[5] as number) + z * (r[9] as number);
    out[at + 2] = x * (r[2] as number) + y * (r[6] as number) + z * (r[10] as number);
    out[at + 3] = x * (r[3] as number) + y * (r[7] as number) + z * (r[11] as number) + t;
  }
}

/** The inverse of the 3x3 part of a transform at `i`, into out[o..], rows four apart like its source. */
export function invertLinear(out: Floats, o: number, m: Floats, i: number): void {
  const a = m[i] as number, b = m[i + 1] as number, c = m[i + 2] as number;
  const d = m[i + 4] as number, e = m[i + 5] as number, f = m[i + 6] as number;
  const g = m[i + 8] as number, h = m[i + 9] as number, k = m[i + 10] as number;
  const scale = 1 / (a * (e * k - f * h) - b * (d * k - f * g) + c * (d * h - e * g));
  out[o] = (e * k - f * h) * scale;
  out[o + 1] = (c * h - b * k) * scale;
  out[o + 2] = (b * f - c * e) * scale;
  out[o + 4] = (f * g - d * k) * scale;
  out[o + 5] = (a * k - c * g) * scale;
  out[o + 6] = (c * d - a * f) * scale;
  out[o + 8] = (d * h - e * g) * scale;
  out[o + 9] = (b * g - a * h) * scale;
  out[o + 10] = (a * e - b * d) * scale;
}

/** out = a b of 3x3 parts whose rows are four apart; translations stay. `out` may be `a` or `b`. */
export function multiplyLinear(out: Floats, o: number, a: Floats, i: number, b: Floats, j: number): void {
  const r = RIGHT;
  for (let k = 0; k < 11; k++) r[k] = b[j + k] as number;
  for (let row = 0; row < 12; row += 4) {
    const x = a[i + row] as number, y = a[i + row + 1] as number, z = a[i + row + 2] as number;
    for (let column = 0; column < 3; column++) {
      out[o + row + column] = x * (r[column] as number) + y * (r[4 + column] as number) + z * (r[8 + column] as number);
    }
  }
}

/** Writes the identity [3, 4] or, with `rows` 4, [4, 4]. */
export function setIdentity(out: Floats, o: number, rows: 3 | 4): void {
  for (let k = 0; k < 4 * rows; k++) out[o + k] = k % 5 === 0 ? 1 : 0;
}

const COFACTOR = new Float64Array(12);

/** The rotation factor of the 3x3 part at `o`, rows four apart, in place: `steps` Newton steps R <- (R + R^-T) / 2. */
export function polar(m: Floats, o: number, steps: number): void {
  for (let step = 0; step < steps; step++) {
    invertLinear(COFACTOR, 0, m, o);
    for (let row = 0; row < 3; row++) {
      for (let column = 0; column < 3; column++) {
        const at = o + 4 * row + column;
        m[at] = ((m[at] as number) + (COFACTOR[4 * column + row] as number)) / 2;
      }
    }
  }
}

const QUAT = new Float64Array(4);

/** The rotation of a rotation vector at v[i] (axis times angle, radians) as a 3x3 part at `o`, rows four apart. */
export function setRotation(out: Floats, o: number, v: Floats, i: number): void {
  const x = v[i] as number, y = v[i + 1] as number, z = v[i + 2] as number;
  const angle = Math.sqrt(x * x + y * y + z * z);
  const sine = angle > 0 ? Math.sin(angle / 2) / angle : 0;
  QUAT[0] = Math.cos(angle / 2);
  QUAT[1] = x * sine;
  QUAT[2] = y * sine;
  QUAT[3] = z * sine;
  setFromQuat(out, o, QUAT, 0);
}

/** The rotation of a unit quaternion (w, x, y, z) at q[i] as a 3x3 part at `o`, rows four apart. */
export function setFromQuat(out: Floats, o: number, q: Floats, i: number): void {
  const w = q[i] as number, x = q[i + 1] as number, y = q[i + 2] as number, z = q[i + 3] as number;
  out[o] = 1 - 2 * (y * y + z * z);
  out[o + 1] = 2 * (x * y - w * z);
  out[o + 2] = 2 * (x * z + w * y);
  out[o + 4] = 2 * (x * y + w * z);
  out[o + 5] = 1 - 2 * (x * x + z * z);
  out[o + 6] = 2 * (y * z - w * x);
  out[o + 8] = 2 * (x * z - w * y);
  out[o + 9] = 2 * (y * z + w * x);
  out[o + 10] = 1 - 2 * (x * x + y * y);
}

/** The unit quaternion (w, x, y, z) of the rotation at `i`, rows four apart; its largest component is positive. */
export function quatFromMatrix(out: Floats, o: number, m: Floats, i: number): void {
  const d0 = m[i] as number, d1 = m[i + 5] as number, d2 = m[i + 10] as number;
  const ww = 1 + d0 + d1 + d2, xx = 1 + d0 - d1 - d2, yy = 1 - d0 + d1 - d2, zz = 1 - d0 - d1 + d2;
  const a = (m[i + 9] as number) - (m[i + 6] as number);
  const b = (m[i + 2] as number) - (m[i + 8] as number);
  const c = (m[i + 4] as number) - (m[i + 1] as number);
  const d = (m[i + 4] as number) + (m[i + 1] as number);
  const e = (m[i + 2] as number) + (m[i + 8] as number);
  const f = (m[i + 9] as number) + (m[i + 6] as number);
  const most = Math.max(ww, xx, yy, zz);
  const scale = 1 / (2 * Math.sqrt(most));
  const w = most === ww ? ww : most === xx ? a : most === yy ? b : c;
  const x = most === ww ? a : most === xx ? xx : most === yy ? d : e;
  const y = most === ww ? b : most === xx ? d : most === yy ? yy : f;
  const z = most === ww ? c : most === xx ? e : most === yy ? f : zz;
  out[o] = w * scale;
  out[o + 1] = x * scale;
  out[o + 2] = y * scale;
  out[o + 3] = z * scale;
}
