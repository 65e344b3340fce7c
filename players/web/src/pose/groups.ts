import type { Avatar, Group, Skeleton } from "../avatar.js";
import { POLAR_STEPS } from "../made/constants.js";
import { polar, setIdentity } from "./affine.js";
import { Anchors } from "./anchors.js";
import { rigidFit, setMean } from "./rigid.js";

/** Part of stage `joints`: one rigid or mixed transform for each group of Gaussians. */
export class Groups {
  /** Mesh from binding mesh, [G, 3, 4]. */
  readonly matrix: Float32Array;
  /** Rotations of quaternions and of SH, [G, 3, 4] with a last column of 0. */
  readonly rotation: Float32Array;
  /** The anchor vertices; null where no group needs them. */
  readonly anchors: Anchors | null;
  private readonly weights: Float64Array; // of each row in `anchors`
  private readonly centre = new Float64Array(3);
  private readonly mixes: readonly Mix[];
  private readonly groups: readonly Group[];
  private readonly headBone: number; // -1: none
  private readonly made = new Float64Array(12);

  constructor(avatar: Avatar) {
    this.groups = avatar.groups;
    this.matrix = new Float32Array(12 * avatar.groups.length);
    this.rotation = new Float32Array(12 * avatar.groups.length);
    avatar.groups.forEach((_, g) => this.still(g));
    const names = avatar.skeleton?.names ?? [];
    this.mixes = avatar.groups.map((group) => mixOf(group, names));
    this.headBone = avatar.rules["rotation"] === "head_bone" ? names.indexOf(avatar.rules["rotation_joint"] ?? "") : -1;
    const listed = anchorsOf(avatar.groups, avatar.skeleton);
    const unique = [...new Set(listed)].sort((a, b) => a - b);
    const place = new Map(unique.map((vertex, row) => [vertex, row]));
    this.anchors = unique.length > 0 ? new Anchors(avatar.program, Uint32Array.from(unique)) : null;
    this.weights = new Float64Array(unique.length);
    for (const vertex of listed) {
      const row = place.get(vertex) as number;
      this.weights[row] = avatar.rules["anchor"] === "unique" ? 1 : (this.weights[row] as number) + 1;
    }
    if (this.anchors !== null) setMean(this.centre, this.anchors.rest, this.weights);
  }

  /** Computes `matrix` and `rotation` of skin matrices [J, 3, 4] and the posed anchors. */
  update(skin: Float64Array): void {
    for (let g = 0; g < this.groups.length; g++) {
      const binding = this.groups[g]?.binding;
      if (binding === "anchor" && this.anchors !== null) {
        rigidFit(this.made, this.anchors.rest, this.anchors.posed, this.weights, this.centre);
        this.write(g, true);
      } else if (binding === "joint_mix") {
        mix(this.made, this.mixes[g] as Mix, skin);
        this.write(g, true);
        polar(this.made, 0, POLAR_STEPS);
        this.write(g, false);
      } else if (binding === "skin" && this.headBone >= 0) {
        for (let k = 0; k < 12; k++) this.made[k] = skin[12 * this.headBone + k] as number;
        polar(this.made, 0, POLAR_STEPS);
        this.write(g, false);
      }
    }
  }

  private still(g: number): void {
    setIdentity(this.matrix, 12 * g, 3);
    setIdentity(this.rotation, 12 * g, 3);
  }

  /** Copies `made` to the group's rotation, and with `whole` to its matrix too. */
  private write(g: number, whole: boolean): void {
    for (let k = 0, at = 12 * g; k < 12; k++, at++) {
      const value = this.made[k] as number;
      this.rotation[at] = k % 4 === 3 ? 0 : value;
      if (whole) this.matrix[at] = value;
    }
  }
}

/** M = sum_j c_j A_j + (1 - sum_j c_j) I. */
interface Mix {
  readonly joints: Uint32Array;
  readonly factors: Float64Array;
  readonly rest: number;
}

function mixOf(group: Group, names: readonly string[]): Mix {
  const entries = Object.entries(group.jointMix);
  const factors = Float64Array.from(entries, ([, factor]) => factor);
  return {
    joints: Uint32Array.from(entries, ([name]) => names.indexOf(name)),
    factors,
    rest: 1 - factors.reduce((sum, factor) => sum + factor, 0),
  };
}

function mix(out: Float64Array, { joints, factors, rest }: Mix, skin: Float64Array): void {
  for (let k = 0; k < 12; k++) {
    let sum = k % 5 === 0 ? rest : 0;
    for (let i = 0; i < joints.length; i++) {
      sum += (factors[i] as number) * (skin[12 * (joints[i] as number) + k] as number);
    }
    out[k] = sum;
  }
}

/** The anchor vertices, repeats kept; none where no group follows them. */
function anchorsOf(groups: readonly Group[], skeleton: Skeleton | null): Uint32Array {
  const needed = skeleton !== null && groups.some((group) => group.binding === "anchor");
  return needed ? skeleton.anchorVertices : new Uint32Array(0);
}
