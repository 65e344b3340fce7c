// The values of a frame that passes ask for by name, in one array of floats.

import type { Camera } from "./camera.js";
import { FRAME_SOURCES } from "./pack/model.js";
import { invertLinear, quatFromMatrix } from "./pose/affine.js";
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
  /** The float that is 1 where the scene has a light. */
  readonly lit: number;

  constructor(groups: number) {
    const first: Record<string, number> = {};
    let at = 0;
    for (const [name, floats] of Object.entries(FRAME_SOURCES)) {
      first[name] = at;
      at += floats * (name.startsWith(PER_GROUP) ? groups : 1);
    }
    this.first = first;
    this.lit = at;
    this.size = at + 1;
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
  /** First float of the light, as `Lighting.write` has it. */
  readonly lightAt: number;
  private readonly view = new Float64Array(16); // camera from avatar
  private readonly clip = new Float64Array(16);
  private readonly inverse = new Float64Array(12);
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
    this.lightAt = this.layout.first["light_ambient0"] as number;
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
    quatFromMatrix(this.floats, first["world_quat_wxyz"] as number, posed.worldFromAvatar, 0);
  }

  /**
   * The camera, seen from the pack's own space. `place` is scene from pack, [4, 4] row-major: any affine matrix, also one
   * that scales or mirrors. A singular one draws nothing: every Gaussian is at depth 0.
   */
  setCamera(camera: Camera, place: Float64Array): void {
    const { first } = this.layout;
    multiply(camera.cameraFromWorld, place, this.view);
    multiply(camera.clipFromWorld, place, this.clip);
    if (!this.setEye(place, camera.centre)) this.view.fill(0);
    for (let row = 0; row < 3; row++) this.setRow(this.cameraRows[row] as number, this.view, row);
    for (let row = 0; row < 4; row++) this.setRow(this.clipRows[row] as number, this.clip, row);
    const tan = first["tan_half_fov"] as number;
    this.floats[tan] = camera.tanHalfFov[0] as number;
    this.floats[tan + 1] = camera.tanHalfFov[1] as number;
    const size = first["image_size"] as number;
    this.floats[size] = camera.width;
    this.floats[size + 1] = camera.height;
  }

  /** Where the camera is in the pack's own space; false if `place` is singular. */
  private setEye(place: Float64Array, centre: Float32Array): boolean {
    const { inverse } = this;
    invertLinear(inverse, 0, place, 0);
    const x = (centre[0] as number) - (place[3] as number);
    const y = (centre[1] as number) - (place[7] as number);
    const z = (centre[2] as number) - (place[11] as number);
    const eye = this.layout.first["eye"] as number;
    let finite = true;
    for (let i = 0; i < 3; i++) {
      const at = (inverse[4 * i] as number) * x + (inverse[4 * i + 1] as number) * y + (inverse[4 * i + 2] as number) * z;
      finite &&= Math.abs(at) < Infinity;
      this.floats[eye + i] = finite ? at : 0;
    }
    this.floats[eye + 3] = 1;
    return finite;
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
