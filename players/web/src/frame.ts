// The values of a frame that passes ask for by name, in one array of floats.

import type { Camera } from "./camera.js";
import { FRAME_SOURCES } from "./pack/model.js";
import type { Posed } from "./pose/poser.js";

const PER_GROUP = "group_";
const SOURCE = /^(\w+?)(?:\[(\d+)\])?$/;

/** Where a named value lies in `FrameValues.floats`. */
export interface Place {
  readonly first: number;
  readonly floats: number;
}

/** First float of every value, for an avatar of `groups` groups; `size` is the number of floats. */
export class FrameLayout {
  readonly first: Readonly<Record<string, number>>;
  readonly size: number;

  constructor(groups: number) {
    const first: Record<string, number> = {};
    let at = 0;
    for (const [name, floats] of Object.entries(FRAME_SOURCES)) {
      first[name] = at;
      at += floats * (name.startsWith(PER_GROUP) ? groups : 1);
    }
    this.first = first;
    this.size = at;
  }

  /** The place of "world_row0" or "group_matrix_row1[2]". The pack's check has refused other names. */
  place(source: string): Place {
    const found = SOURCE.exec(source);
    const name = found?.[1] ?? "";
    const floats = FRAME_SOURCES[name] ?? 0;
    const first = this.first[name] ?? 0;
    return { first: first + floats * Number(found?.[2] ?? 0), floats };
  }
}

/** Values of one frame for one avatar. All methods write into `floats` and allocate nothing. */
export class FrameValues {
  readonly layout: FrameLayout;
  readonly floats: Float32Array;
  private readonly view = new Float64Array(16); // camera from avatar
  private readonly clip = new Float64Array(16);
  private readonly eye = new Float64Array(3);
  // First float of each row: names made in a frame would be new strings.
  private readonly worldRows: readonly number[];
  private readonly cameraRows: readonly number[];
  private readonly clipRows: readonly number[];
  private readonly matrixRows: readonly number[];
  private readonly rotationRows: readonly number[];

  constructor(readonly groups: number) {
    this.layout = new FrameLayout(groups);
    const rows = (name: string, count: number): number[] =>
      Array.from({ length: count }, (_, row) => this.layout.first[`${name}_row${row}`] as number);
    this.worldRows = rows("world", 3);
    this.cameraRows = rows("camera", 3);
    this.clipRows = rows("clip", 4);
    this.matrixRows = rows("group_matrix", 3);
    this.rotationRows = rows("group_rotation", 3);
    this.floats = new Float32Array(this.layout.size);
  }

  /** The results of stage `joints`. */
  setPosed(posed: Posed): void {
    const { first } = this.layout;
    for (let row = 0; row < 3; row++) {
      const world = this.worldRows[row] as number;
      for (let c = 0; c < 4; c++) this.floats[world + c] = posed.worldFromAvatar[4 * row + c] as number;
      this.setRows(this.matrixRows[row] as number, posed.groupMatrix, row);
      this.setRows(this.rotationRows[row] as number, posed.groupRotation, row);
    }
    quatFromMatrix(posed.worldFromAvatar, this.floats, first["world_quat_wxyz"] as number);
  }

  /**
   * The camera, seen from the pack's own space: `world` [4, 4] row-major places the pack in the scene. Any affine
   * matrix will do, also one that scales or mirrors. A singular matrix draws nothing: every Gaussian is at depth 0.
   */
  setCamera(camera: Camera, world: Float64Array): void {
    const { first } = this.layout;
    multiply(camera.cameraFromWorld, world, this.view);
    multiply(camera.clipFromWorld, world, this.clip);
    if (!solve(world, camera.centre, this.eye)) this.view.fill(0);
    for (let row = 0; row < 3; row++) this.setRow(this.cameraRows[row] as number, this.view, row);
    for (let row = 0; row < 4; row++) this.setRow(this.clipRows[row] as number, this.clip, row);
    const eye = first["eye"] as number;
    for (let i = 0; i < 3; i++) this.floats[eye + i] = this.eye[i] as number;
    this.floats[eye + 3] = 1;
    const tan = first["tan_half_fov"] as number;
    this.floats[tan] = camera.tanHalfFov[0] as number;
    this.floats[tan + 1] = camera.tanHalfFov[1] as number;
    const size = first["image_size"] as number;
    this.floats[size] = camera.width;
    this.floats[size + 1] = camera.height;
  }

  private setRow(at: number, matrix: Float64Array, row: number): void {
    for (let c = 0; c < 4; c++) this.floats[at + c] = matrix[4 * row + c] as number;
  }

  /** Row `row` of each [3, 4] of a table by group. */
  private setRows(at: number, table: Float32Array, row: number): void {
    for (let g = 0; g < this.groups; g++) {
      for (let c = 0; c < 4; c++) this.floats[at + 4 * g + c] = table[12 * g + 4 * row + c] as number;
    }
  }
}

/** out = a b, row-major 4x4. */
function multiply(a: ArrayLike<number>, b: ArrayLike<number>, out: Float64Array): void {
  for (let r = 0; r < 4; r++) {
    for (let c = 0; c < 4; c++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) sum += (a[4 * r + k] as number) * (b[4 * k + c] as number);
      out[4 * r + c] = sum;
    }
  }
}

/** The point whose image under the affine matrix `m` is `point`; false if `m` is singular. */
function solve(m: Float64Array, point: ArrayLike<number>, out: Float64Array): boolean {
  const a = m[0] as number, b = m[1] as number, c = m[2] as number;
  const d = m[4] as number, e = m[5] as number, f = m[6] as number;
  const g = m[8] as number, h = m[9] as number, i = m[10] as number;
  const x = (point[0] as number) - (m[3] as number);
  const y = (point[1] as number) - (m[7] as number);
  const z = (point[2] as number) - (m[11] as number);
  const ei = e * i - f * h, fg = f * g - d * i, dh = d * h - e * g;
  const det = a * ei + b * fg + c * dh;
  if (!(Math.abs(det) > 0) || !Number.isFinite(det)) return false;
  out[0] = (x * ei + y * (c * h - b * i) + z * (b * f - c * e)) / det;
  out[1] = (x * fg + y * (a * i - c * g) + z * (c * d - a * f)) / det;
  out[2] = (x * dh + y * (b * g - a * h) + z * (a * e - b * d)) / det;
  return true;
}

/** Unit quaternion wxyz of the rotation in a row-major 4x4. Its largest component is positive. */
function quatFromMatrix(m: Float64Array, out: Float32Array, at: number): void {
  const d0 = m[0] as number, d1 = m[5] as number, d2 = m[10] as number;
  const a = (m[9] as number) - (m[6] as number), b = (m[2] as number) - (m[8] as number);
  const c = (m[4] as number) - (m[1] as number), d = (m[4] as number) + (m[1] as number);
  const e = (m[2] as number) + (m[8] as number), f = (m[9] as number) + (m[6] as number);
  const w = 1 + d0 + d1 + d2, x = 1 + d0 - d1 - d2, y = 1 - d0 + d1 - d2, z = 1 - d0 - d1 + d2;
  const most = Math.max(w, x, y, z);
  const s = 1 / (2 * Math.sqrt(most));
  out[at] = (most === w ? w : most === x ? a : most === y ? b : c) * s;
  out[at + 1] = (most === w ? a : most === x ? x : most === y ? d : e) * s;
  out[at + 2] = (most === w ? b : most === x ? d : most === y ? y : f) * s;
  out[at + 3] = (most === w ? c : most === x ? e : most === y ? f : z) * s;
}
