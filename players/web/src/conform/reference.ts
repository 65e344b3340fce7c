// The files of NAME.reference (SPEC.md, section 16).

/** An array of the reference by its tensor's name. */
export interface Named {
  readonly tensor: string;
  readonly dtype: string;
  readonly shape: readonly number[];
}

/** An expected output with its tolerance: an element may be off by atol * weight + rtol * |reference|. */
export interface Expected extends Named {
  readonly atol: number;
  readonly rtol: number;
  readonly weight?: Named;
  readonly flips?: "sign" | "drawn" | "cutoff" | "shadow";
  readonly most_flips?: number;
}

/** One stage of a case. */
export interface Step {
  readonly stage: string;
  readonly profile?: string;
  readonly pixels?: Named;
  readonly inputs: Readonly<Record<string, Named>>;
  readonly outputs: Readonly<Record<string, Expected>>;
}

/** One pose seen by one camera. */
export interface Case {
  readonly name: string;
  readonly camera: {
    readonly camera_from_world: readonly (readonly number[])[];
    readonly clip_from_world: readonly (readonly number[])[];
    readonly centre: readonly number[];
    readonly tan_half_fov_x: number;
    readonly tan_half_fov_y: number;
    readonly width: number;
    readonly height: number;
  };
  readonly stages: readonly Step[];
}

export type Numbers = Float32Array | Float64Array | Int32Array | Uint32Array | BigInt64Array | Uint8Array | Uint16Array;
/** Arrays by name. */
export type Tensors = Readonly<Record<string, Numbers>>;

/** Cases and their tensors. */
export interface Reference {
  readonly cases: readonly Case[];
  readonly tensors: Tensors;
}

const TYPES = {
  F64: Float64Array, F32: Float32Array, I64: BigInt64Array, I32: Int32Array, U32: Uint32Array, U16: Uint16Array, U8: Uint8Array,
} as const;

/** A reference from the texts and bytes of cases.json and vectors.safetensors. */
export function parseReference(casesJson: string, vectors: ArrayBuffer): Reference {
  return { ...(JSON.parse(casesJson) as { cases: Case[] }), tensors: readTensors(vectors) };
}

/** Tensors of a .safetensors file. */
export function readTensors(file: ArrayBuffer): Tensors {
  const size = Number(new DataView(file).getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(file, 8, size))) as Record<
    string,
    { dtype: keyof typeof TYPES; data_offsets: [number, number] }
  >;
  const found: Record<string, Numbers> = {};
  for (const [name, entry] of Object.entries(header)) {
    if (name === "__metadata__") continue;
    const [begin, end] = entry.data_offsets;
    found[name] = new TYPES[entry.dtype](file.slice(8 + size + begin, 8 + size + end));
  }
  return found;
}
