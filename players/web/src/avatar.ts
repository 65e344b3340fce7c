import type { Program } from "./pack/model.js";

/** An expression: a blendshape weight that a pose sets. */
export interface Expression {
  readonly name: string;
  readonly aliases: readonly string[];
  readonly range: readonly [low: number, high: number]; // trained
}

/** Skeleton at rest. Matrices are row-major 4x4 for column vectors, float64 as stage `joints` computes. */
export interface Skeleton {
  readonly names: readonly string[]; // J
  readonly parents: Int32Array; // [J], -1 for a root
  readonly restLocal: Float64Array; // [J, 4, 4] parent from joint
  readonly inverseBindMatrix: Float64Array; // [J, 4, 4]
  readonly jointBasis: Float64Array; // [K, J, 3] metres
  readonly correctiveJoints: Uint32Array; // [C]
  readonly anchorVertices: Uint32Array; // [A]
}

/** A group of Gaussians with one binding. */
export interface Group {
  readonly name: string;
  readonly first: number;
  readonly count: number;
  readonly binding: string;
  readonly jointMix: Readonly<Record<string, number>>;
}

/** A recorded motion. Frame t of an array is at t * row size. */
export interface ClipData {
  readonly name: string;
  readonly fps: number;
  readonly frames: number; // T
  readonly expressionWeights: Float32Array; // [T, K]
  readonly lateWeights: Float32Array; // [T, L]
  readonly jointDelta: Float32Array; // [T, J, 4, 4]
  readonly worldFromAvatar: Float32Array; // [T, 4, 4]
}

/** How ARKit inputs drive the avatar: outputs = matrix @ inputs, and the joints of measured rotations. */
export interface Driving {
  readonly inputs: readonly string[];
  readonly outputs: readonly string[]; // "expression/NAME", "eyelid/NAME", "joint/NAME/x"
  readonly matrix: Float64Array; // [outputs, inputs]
  readonly headJoint: string | null;
  readonly headPivot: readonly [number, number, number];
  readonly leftEyeJoint: string | null;
  readonly rightEyeJoint: string | null;
}

/** The light in which an avatar was captured, which the light of a scene can replace. */
export interface Relight {
  readonly frame: "head" | "world"; // what that light moved with
  readonly ambient: readonly (readonly [number, number, number])[]; // [9] linear, as SH of a normal
  readonly centre: readonly [number, number, number]; // what casts shadows lies within `radius` of it, metres
  readonly radius: number;
  readonly joint: string | null; // the head's, which the light moved with; null: it moved with the avatar, or was still
}

/** A level of detail as a person sees it. */
export interface LevelInfo {
  readonly count: number; // Gaussians
  readonly heightPx: number | null; // `Instance.heightPx` up to which it is meant; null: any
  readonly psnrDb: number | null; // inside the mask
}

/** Where to look at rest, metres: the whole avatar or its head. In the frame of `Instance.place`, for packs of either handedness. */
export interface Framing {
  readonly up: readonly [number, number, number];
  readonly front: readonly [number, number, number];
  readonly whole: { readonly target: readonly [number, number, number]; readonly size: readonly [number, number, number] };
  readonly head: { readonly target: readonly [number, number, number]; readonly size: readonly [number, number, number] } | null;
}

/**
 * A loaded and checked pack. Nothing of it is on a GPU yet, and nothing of it changes. Arrays and matrices are in the
 * pack's frame, which `handedness` names; `framing` and `bounds` are right-handed for every pack.
 */
export interface Avatar {
  readonly name: string;
  readonly license: string | null;
  readonly consent: string | null;
  readonly handedness: "right" | "left";
  readonly expressions: readonly Expression[]; // K
  readonly eyelids: readonly string[]; // L
  readonly skeleton: Skeleton | null;
  readonly groups: readonly Group[];
  readonly rules: Readonly<Record<string, string | null>>; // `rules` of the manifest
  readonly clips: readonly ClipData[];
  readonly driving: Driving | null; // null: ARKit cannot drive it
  readonly levels: readonly LevelInfo[]; // finest first
  readonly framing: Framing;
  readonly bounds: { readonly low: readonly [number, number, number]; readonly high: readonly [number, number, number] } | null;
  readonly background: readonly [number, number, number] | null; // display-referred; null: random in training
  readonly preview: Uint8Array | null; // WebP
  readonly relight: Relight | null; // null: no light of a scene changes its colours
  readonly triangles: Uint32Array | null; // [3, F] where no Gaussian is embedded
  readonly bytes: number; // of the file
  readonly program: Program;
}
