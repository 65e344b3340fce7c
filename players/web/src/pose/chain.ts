import type { Skeleton } from "../avatar.js";
import { invertLinear, multiply, multiplyLinear } from "./affine.js";

/** Stage `joints`, float64: skin matrices of a skeleton. */
export class Chain {
  /** Skin matrices, mesh from binding mesh, [J, 3, 4]. */
  readonly skin: Float64Array;
  private readonly local: Float64Array; // [J, 3, 4] parent from joint at rest
  private readonly inverseBind: Float64Array; // [J, 3, 4]
  private readonly fromMesh: Float64Array; // [J, 3, 4] inverse of the linear part of the parent's rest transform
  private readonly moved: Float64Array; // [J, 3] how expressions move rest joints, mesh space
  private readonly posed: Float64Array; // [J, 3, 4]
  private readonly moving: Uint32Array; // expressions that move a joint
  private readonly step = new Float64Array(12);

  constructor(private readonly skeleton: Skeleton) {
    const joints = skeleton.names.length;
    this.skin = new Float64Array(12 * joints);
    this.local = rows(skeleton.restLocal);
    this.inverseBind = rows(skeleton.inverseBindMatrix);
    this.fromMesh = inverseRest(skeleton.parents, this.local);
    this.moved = new Float64Array(3 * joints);
    this.posed = new Float64Array(12 * joints);
    this.moving = movingExpressions(skeleton.jointBasis, 3 * joints);
  }

  /** Computes `skin` of weights [K] and deltas [J, 4, 4]. */
  update(weights: Float32Array, delta: Float64Array): void {
    this.moveJoints(weights);
    const { parents } = this.skeleton;
    for (let joint = 0; joint < parents.length; joint++) {
      const parent = parents[joint] as number;
      this.restStep(joint, parent);
      const at = 12 * joint;
      if (parent >= 0) multiply(this.step, 0, this.posed, 12 * parent, this.step, 0);
      multiply(this.posed, at, this.step, 0, delta, 16 * joint);
      multiply(this.skin, at, this.posed, at, this.inverseBind, at);
      this.unmove(joint);
    }
  }

  /** d_j = sum_k w_k basis[k, j]. */
  private moveJoints(weights: Float32Array): void {
    const { moved, moving } = this;
    const basis = this.skeleton.jointBasis;
    moved.fill(0);
    for (let i = 0; i < moving.length; i++) {
      const k = moving[i] as number;
      const weight = weights[k] as number;
      if (weight !== 0) {
        for (let c = 0, at = k * moved.length; c < moved.length; c++, at++) {
          moved[c] = (moved[c] as number) + weight * (basis[at] as number);
        }
      }
    }
  }

  /**
   * step = B'_parent^-1 B'_joint with B'_j = T(d_j) B_j. Its linear part is that of rest_local; its translation
   * gains (d_joint - d_parent) in the parent's frame. Of a root it is B'_joint.
   */
  private restStep(joint: number, parent: number): void {
    const { step, local, moved, fromMesh } = this;
    const at = 12 * joint;
    for (let k = 0; k < 12; k++) step[k] = local[at + k] as number;
    if (this.moving.length === 0) return;
    const j = 3 * joint, p = 3 * parent;
    const x = (moved[j] as number) - (parent < 0 ? 0 : (moved[p] as number));
    const y = (moved[j + 1] as number) - (parent < 0 ? 0 : (moved[p + 1] as number));
    const z = (moved[j + 2] as number) - (parent < 0 ? 0 : (moved[p + 2] as number));
    for (let row = 0; row < 12; row += 4) {
      const i = at + row;
      const along = (fromMesh[i] as number) * x + (fromMesh[i + 1] as number) * y + (fromMesh[i + 2] as number) * z;
      step[row + 3] = (step[row + 3] as number) + along;
    }
  }

  /** skin = skin T(-d_j). */
  private unmove(joint: number): void {
    if (this.moving.length === 0) return;
    const { skin, moved } = this;
    const x = moved[3 * joint] as number, y = moved[3 * joint + 1] as number, z = moved[3 * joint + 2] as number;
    for (let i = 12 * joint; i < 12 * joint + 12; i += 4) {
      const along = (skin[i] as number) * x + (skin[i + 1] as number) * y + (skin[i + 2] as number) * z;
      skin[i + 3] = (skin[i + 3] as number) - along;
    }
  }
}

/** [J, 4, 4] without its last rows. */
function rows(matrices: Float64Array): Float64Array {
  const found = new Float64Array((matrices.length / 16) * 12);
  for (let joint = 0; 16 * joint < matrices.length; joint++) {
    found.set(matrices.subarray(16 * joint, 16 * joint + 12), 12 * joint);
  }
  return found;
}

/** Linear parts [J, 3, 4] of mesh_from_joint at rest; the fourth column is 0. */
export function restLinear(parents: Int32Array, local: Float64Array): Float64Array {
  const rest = new Float64Array(local.length);
  parents.forEach((parent, joint) => {
    const at = 12 * joint;
    rest.set(local.subarray(at, at + 12), at);
    rest[at + 3] = rest[at + 7] = rest[at + 11] = 0;
    if (parent >= 0) multiplyLinear(rest, at, rest, 12 * parent, rest, at);
  });
  return rest;
}

/** Linear parts [J, 3, 4] at rest of a skeleton. */
export function restOf(skeleton: Skeleton): Float64Array {
  return restLinear(skeleton.parents, rows(skeleton.restLocal));
}

/** For each joint the inverse of its parent's linear part at rest; the identity for a root. */
function inverseRest(parents: Int32Array, local: Float64Array): Float64Array {
  const rest = restLinear(parents, local);
  const found = new Float64Array(local.length);
  parents.forEach((parent, joint) => {
    const at = 12 * joint;
    if (parent < 0) {
      found[at] = found[at + 5] = found[at + 10] = 1;
    } else {
      invertLinear(found, at, rest, 12 * parent);
    }
  });
  return found;
}

function movingExpressions(basis: Float64Array, floats: number): Uint32Array {
  const found: number[] = [];
  for (let k = 0; floats > 0 && k * floats < basis.length; k++) {
    if (basis.subarray(k * floats, (k + 1) * floats).some((value) => value !== 0)) found.push(k);
  }
  return Uint32Array.from(found);
}
