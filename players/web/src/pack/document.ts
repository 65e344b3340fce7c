// The document of a pack, of the form that `checkForm` holds it against: what this player reads of it. What a document
// may lack has a question mark.

import type { Pass, PoseSections } from "./model.js";

export type Vector = readonly [number, number, number];
export type Names = readonly string[];

/** A box with sides along the axes. */
export interface Box {
  readonly min: Vector;
  readonly max: Vector;
}

/** A measured difference from the source. */
export interface Difference {
  readonly psnr_mask_db?: { readonly mean?: number | null };
}

/** A run of Gaussians. */
export interface GroupText {
  readonly name: string;
  readonly first: number;
  readonly count: number;
  readonly binding: string;
  readonly joint_mix?: Readonly<Record<string, number>>;
}

/** Outputs = matrix @ inputs. */
export interface Linear {
  readonly inputs: Names;
  readonly outputs: Names;
  readonly matrix: readonly (readonly number[])[];
}

/** A section of a buffer. */
export interface SectionText {
  readonly name: string;
  readonly bits: 8 | 16 | 32;
  readonly count: number;
  readonly codec: "raw" | "planes" | "delta" | "pointer" | "incidence";
  readonly record?: number;
  readonly tensor?: string;
}

/** A buffer: writable with bytes, or static with sections. */
export interface BufferText {
  readonly name: string;
  readonly bytes?: number;
  readonly sections?: readonly SectionText[];
}

/** An array that no buffer holds. */
export interface ArrayText {
  readonly tensor: string;
  readonly type: "f32" | "u8" | "u16" | "u32" | "i32";
  readonly shape: readonly number[];
  readonly codec: "raw" | "planes";
}

/** Where a camera looks, and how much it sees. */
export interface Framed {
  readonly target: Vector;
  readonly size: Vector;
}

/** The light in which the avatar was captured. */
export interface RelightText {
  readonly frame: "head" | "world";
  readonly joint?: string | null;
  readonly ambient: readonly Vector[];
  readonly centre: Vector;
  readonly radius: number;
}

/** The manifest of the avatar. */
export interface AvatarText {
  readonly name: string;
  readonly frame: { readonly handedness: "right" | "left" };
  readonly rules: Readonly<Record<string, unknown>>;
  readonly expressions: readonly { readonly name: string; readonly aliases?: Names; readonly range: readonly [number, number] }[];
  readonly late_morphs: Names;
  readonly joints: Names | null;
  readonly clips: readonly { readonly name: string; readonly fps: number; readonly frames: number }[];
  readonly driving: Partial<Omit<Linear, "matrix">> & {
    readonly mode: "names" | "matrix" | "none";
    readonly matrix?: Linear["matrix"] | null;
    readonly head_joint?: string | null;
    readonly head_pivot?: Vector;
    readonly left_eye_joint?: string | null;
    readonly right_eye_joint?: string | null;
  };
  readonly background: Vector | string;
  readonly relight?: RelightText;
  readonly bounds: { readonly rest: Box; readonly swept: Box };
  readonly provenance: { readonly licence?: unknown; readonly consent?: unknown };
}

/** All of it. */
export interface Document {
  readonly shaders: number;
  readonly avatar: AvatarText;
  readonly levels: readonly {
    readonly count: number;
    readonly groups: readonly GroupText[];
    readonly height_px?: number | null;
    readonly error?: Difference;
  }[];
  readonly program: {
    readonly buffers: readonly BufferText[];
    readonly pose: PoseSections;
    readonly pose_floats: number;
    readonly reads_mesh: boolean;
    readonly mesh: readonly Pass[];
    readonly levels: readonly {
      readonly prefix: string;
      readonly chunks: readonly (readonly [first: number, count: number])[];
      readonly deform: readonly Pass[];
      readonly view: readonly Pass[];
      readonly shadow?: readonly Pass[];
      readonly light?: readonly Pass[];
    }[];
  };
  readonly arrays: Readonly<Record<string, ArrayText>>;
  readonly driving?: Linear;
  readonly framing?: { readonly up: Vector; readonly front: Vector; readonly whole?: Framed | null; readonly head?: Framed | null };
  readonly error?: Difference;
}
