// The skeleton of a pack, for stage `joints`.

import type { Group, Skeleton } from "../avatar.js";
import { AvatarError, noSuch } from "../errors.js";
import type { HeldArray } from "./tensors.js";

const LARGEST = 1e6; // number of a matrix
const LEAST_VOLUME = 1e-18; // of the 3x3 part of a matrix that has an inverse
const TINY = 1e-300; // the same, of a product of such matrices
const FEWEST_ANCHORS = 3;

type Arrays = ReadonlyMap<string, HeldArray>;

/** The skeleton of joints `names` with K expressions and V mesh vertices. Throws AvatarError. */
export function readSkeleton(
  arrays: Arrays,
  names: readonly string[],
  expressions: number,
  vertices: number,
): Skeleton {
  const joints = names.length;
  const parents = taken(arrays, "rig.parents", Int32Array, [joints]);
  const restLocal = taken(arrays, "rig.rest_local", Float32Array, [joints, 4, 4]);
  const inverseBind = taken(arrays, "rig.inverse_bind_matrix", Float32Array, [joints, 4, 4]);
  const basis = taken(arrays, "rig.joint_basis", Float32Array, [expressions, joints, 3]);
  const correctives = taken(arrays, "rig.corrective_joints", Int32Array, [-1]);
  const anchors = taken(arrays, "rig.anchor_vertices", Uint32Array, [-1]);
  parents.forEach((parent, joint) => {
    if (parent >= joint || parent < -1) {
      throw new AvatarError("a parent must come before its children; a root is -1", { field: "array rig.parents" });
    }
  });
  checkAffine(restLocal, "array rig.rest_local");
  checkAffine(inverseBind, "array rig.inverse_bind_matrix");
  checkFinite(basis, "array rig.joint_basis");
  checkBelow(correctives, joints, "array rig.corrective_joints");
  checkBelow(anchors, vertices, "array rig.anchor_vertices");
  checkRest(names, parents, restLocal);
  return {
    names,
    parents,
    restLocal: Float64Array.from(restLocal),
    inverseBindMatrix: Float64Array.from(inverseBind),
    jointBasis: Float64Array.from(basis),
    correctiveJoints: Uint32Array.from(correctives),
    anchorVertices: anchors,
  };
}

/** The triangles [3, F] of a mesh of V vertices that no kernel reads. Throws AvatarError. */
export function readTriangles(arrays: Arrays, vertices: number): Uint32Array {
  const corners = taken(arrays, "rig.triangles", Uint32Array, [3, -1]);
  checkBelow(corners, vertices, "array rig.triangles");
  return corners;
}

type Kind<T> = new () => T;
const NAMES = new Map<unknown, string>([[Float32Array, "f32"], [Int32Array, "i32"], [Uint32Array, "u32"]]);

/** An array of a type and shape; -1 is any length. */
function taken<T extends HeldArray["values"]>(
  arrays: Arrays,
  name: string,
  kind: Kind<T>,
  shape: readonly number[],
): T {
  const held = arrays.get(name);
  if (held === undefined) throw new AvatarError("is missing", { field: `array ${name}` });
  const same = shape.every((length, i) => length === -1 || length === held.shape[i]);
  if (!(held.values instanceof kind) || !same || held.shape.length !== shape.length) {
    const wanted = `${NAMES.get(kind)} [${shape.join(", ")}]`;
    throw new AvatarError(`is ${held.type} [${held.shape.join(", ")}], not ${wanted}`, { field: `array ${name}` });
  }
  return held.values;
}

/** Throws AvatarError for a number that is not finite. */
export function checkFinite(values: Float32Array, field: string): void {
  for (let i = 0; i < values.length; i++) {
    if (!Number.isFinite(values[i])) throw new AvatarError("holds a number that is not finite", { field });
  }
}

function checkBelow(values: Int32Array | Uint32Array, end: number, field: string): void {
  for (const value of values) {
    if (value < 0 || value >= end) throw new AvatarError(`holds ${value}; 0 to ${end - 1} are taken`, { field });
  }
}

function checkAffine(matrices: Float32Array, field: string): void {
  for (let at = 0; at < matrices.length; at += 16) {
    const small = matrices.subarray(at, at + 16).every((value) => Math.abs(value) <= LARGEST);
    if (!small || !hasAffineRow(matrices, at) || !(Math.abs(volume(matrices, at)) > LEAST_VOLUME)) {
      throw new AvatarError("is not an affine matrix with an inverse", { field: `${field}[${at / 16}]` });
    }
  }
}

/** Throws AvatarError for a joint whose rest transform, through all its parents, has no inverse. */
function checkRest(names: readonly string[], parents: Int32Array, local: Float32Array): void {
  const rest = Float64Array.from(local);
  parents.forEach((parent, joint) => {
    const own = rest.subarray(16 * joint, 16 * joint + 16);
    for (let i = 0; parent >= 0 && i < 12; i++) {
      let sum = 0;
      for (let k = 0; k < 4; k++) {
        sum += (rest[16 * parent + (i & 12) + k] as number) * (local[16 * joint + 4 * k + (i & 3)] as number);
      }
      own[i] = sum;
    }
    if (!own.every(Number.isFinite) || !(Math.abs(volume(own, 0)) > TINY)) {
      const message = `joint ${names[joint]} and its parents together have no inverse`;
      throw new AvatarError(message, { field: "array rig.rest_local" });
    }
  });
}

/** Whether the last row of a matrix [4, 4] at `at` is 0 0 0 1. */
export function hasAffineRow(m: Float32Array, at: number): boolean {
  return m[at + 12] === 0 && m[at + 13] === 0 && m[at + 14] === 0 && m[at + 15] === 1;
}

/** The determinant of the 3x3 part of a matrix [4, 4] at `at`. */
export function volume(m: Float32Array | Float64Array, at: number): number {
  const [a, b, c] = [m[at] as number, m[at + 1] as number, m[at + 2] as number];
  const [d, e, f] = [m[at + 4] as number, m[at + 5] as number, m[at + 6] as number];
  const [g, h, i] = [m[at + 8] as number, m[at + 9] as number, m[at + 10] as number];
  return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
}

/** Throws AvatarError for a group that asks for a joint or anchors that the skeleton lacks. */
export function checkGroups(groups: readonly Group[], skeleton: Skeleton | null): void {
  const names = new Set(skeleton?.names);
  for (const group of groups) {
    const field = `group ${group.name}`;
    if (group.binding === "anchor" && (skeleton?.anchorVertices.length ?? 0) < FEWEST_ANCHORS) {
      throw new AvatarError(`binding 'anchor' needs at least ${FEWEST_ANCHORS} anchor vertices`, { field });
    }
    if ((group.binding === "joint_mix") !== Object.keys(group.jointMix).length > 0) {
      throw new AvatarError("joint_mix goes with binding 'joint_mix'", { field });
    }
    for (const joint of Object.keys(group.jointMix)) {
      if (!names.has(joint)) checkJoint(joint, skeleton, `${field}, joint_mix`);
    }
  }
}

/** Throws AvatarError for a joint that the skeleton lacks; null is no joint. */
export function checkJoint(name: string | null, skeleton: Skeleton | null, field: string): void {
  const names = skeleton?.names ?? [];
  if (name !== null && !names.includes(name)) throw noSuch("joint of this avatar", name, names, { field });
}
