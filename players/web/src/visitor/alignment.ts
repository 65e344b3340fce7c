// Takes out of a face's points how the head moved: what is left is what the face does.

const UNKNOWNS = 7; // scale, shift x y z, turn about x y z
const DEPTH = 0.3; // how much z counts beside x and y: MediaPipe's depth is rough

/** Where points go by one of the unknowns: [3] for a point at x, y, z. */
function moved(unknown: number, x: number, y: number, z: number, axis: number): number {
  if (unknown === 0) return axis === 0 ? x : axis === 1 ? y : z;
  if (unknown < 4) return unknown - 1 === axis ? 1 : 0;
  if (unknown === 4) return axis === 1 ? -z : axis === 2 ? y : 0;
  if (unknown === 5) return axis === 0 ? z : axis === 2 ? -x : 0;
  return axis === 0 ? -y : axis === 1 ? x : 0;
}

/** The small motion of a rigid face of another size, by least squares over its stable points. */
export class Alignment {
  private readonly gain: Float64Array; // [UNKNOWNS, stable, 3]: points away from rest -> unknowns
  private readonly motion = new Float64Array(UNKNOWNS);

  /** `rest`: every point [P, 3]; `stable`: which of them the face's muscles hardly move. */
  constructor(
    private readonly rest: Float64Array,
    private readonly stable: readonly number[],
  ) {
    const columns = stable.length * 3;
    const model = new Float64Array(UNKNOWNS * columns);
    for (let u = 0; u < UNKNOWNS; u++) {
      stable.forEach((point, i) => {
        for (let axis = 0; axis < 3; axis++) {
          model[u * columns + 3 * i + axis] = this.moves(u, point, axis) * (axis === 2 ? DEPTH : 1);
        }
      });
    }
    const square = new Float64Array(UNKNOWNS * UNKNOWNS);
    for (let a = 0; a < UNKNOWNS; a++) {
      for (let b = 0; b < UNKNOWNS; b++) {
        for (let k = 0; k < columns; k++) {
          square[a * UNKNOWNS + b]! += model[a * columns + k]! * model[b * columns + k]!;
        }
      }
    }
    this.gain = solved(square, model, columns);
  }

  /** Fits the motion to points [P, 3] that are seen now. */
  fit(points: Float64Array): void {
    const columns = this.stable.length * 3;
    this.motion.fill(0);
    for (let i = 0; i < this.stable.length; i++) {
      const at = 3 * (this.stable[i] as number);
      for (let axis = 0; axis < 3; axis++) {
        const away = (points[at + axis]! - this.rest[at + axis]!) * (axis === 2 ? DEPTH : 1);
        for (let u = 0; u < UNKNOWNS; u++) this.motion[u]! += this.gain[u * columns + 3 * i + axis]! * away;
      }
    }
  }

  /** How far a point is from where the fitted motion alone would have taken it, along an axis. */
  left(points: Float64Array, point: number, axis: number): number {
    let rigid = 0;
    for (let u = 0; u < UNKNOWNS; u++) rigid += this.motion[u]! * this.moves(u, point, axis);
    return points[3 * point + axis]! - this.rest[3 * point + axis]! - rigid;
  }

  /** The turn of the fitted motion about an axis, radians. */
  turn(axis: number): number {
    return this.motion[4 + axis]!;
  }

  private moves(unknown: number, point: number, axis: number): number {
    return moved(unknown, this.rest[3 * point]!, this.rest[3 * point + 1]!, this.rest[3 * point + 2]!, axis);
  }
}

/** square^-1 model, by Gauss-Jordan; `square` [n, n] is symmetric and positive. Both are overwritten. */
function solved(square: Float64Array, model: Float64Array, columns: number): Float64Array {
  const n = UNKNOWNS;
  for (let pivot = 0; pivot < n; pivot++) {
    const scale = 1 / (square[pivot * n + pivot]! || 1);
    for (let k = 0; k < n; k++) square[pivot * n + k]! *= scale;
    for (let k = 0; k < columns; k++) model[pivot * columns + k]! *= scale;
    for (let row = 0; row < n; row++) {
      const factor = square[row * n + pivot]!;
      if (row === pivot || factor === 0) continue;
      for (let k = 0; k < n; k++) square[row * n + k]! -= factor * square[pivot * n + k]!;
      for (let k = 0; k < columns; k++) model[row * columns + k]! -= factor * model[pivot * columns + k]!;
    }
  }
  return model;
}
