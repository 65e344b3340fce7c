// A GPU program as data, as avatar_runtime/program/model.py has it: packed buffers and lists of passes.

/** The elements of a section. A float32 is held by its bits. */
export type Elements = Uint8Array | Uint16Array | Uint32Array;

/** A run of equal elements in a packed buffer. It begins at a 32-bit word. */
export interface Section {
  readonly name: string; // the constant by which kernels know where it begins
  readonly elements: Elements; // their size is the width: 8, 16 or 32 bits
}

/** A buffer of the GPU: static with sections, or writable with a size alone. */
export interface Buffer {
  readonly name: string;
  readonly bytes: number;
  readonly sections: readonly Section[]; // none if it is writable
}

/** A number, a vector, or the name of a value of the frame: "world_row0", "group_matrix_row1[2]". */
export type Constant = number | string | readonly number[];

/** One dispatch of one kernel. */
export interface Pass {
  readonly entry: string;
  readonly rows: number; // threads that have work; a group has 64
  readonly buffers: Readonly<Record<string, string>>; // the shader's name -> a name of Program.buffers
  readonly constants: Readonly<Record<string, Constant>>;
}

/** Rows first .. first + count of an avatar's Gaussians. */
export interface Run {
  readonly first: number;
  readonly count: number;
}

/** One level of detail. Chunk i is in the buffers `${prefix}Splats.${i}`, Sh and Projected. */
export interface Level {
  readonly prefix: string;
  readonly chunks: readonly Run[];
  readonly deform: readonly Pass[]; // once a pose
  readonly view: readonly Pass[]; // once a camera
  readonly shadow: readonly Pass[]; // once a pose and light, where one casts shadows; none if nothing can light it
  readonly light: readonly Pass[]; // once a camera, after `view`, where the scene has a light
}

/** First floats of the sections of buffer Pose. */
export interface PoseSections {
  readonly weights: number;
  readonly features: number;
  readonly late: number;
  readonly joints: number;
}

/** All that a player runs up to stage project. Sorting and drawing belong to its scene. */
export interface Program {
  readonly buffers: ReadonlyMap<string, Buffer>;
  readonly mesh: readonly Pass[]; // stages morph and skin
  readonly levels: readonly Level[]; // finest first
  readonly pose: PoseSections;
  readonly poseFloats: number;
  readonly readsMesh: boolean; // deform reads Mesh, so mesh runs before it
}

/** What a pass may ask of a frame: name -> floats. Names that begin with `group_` have a row a group. */
export const FRAME_SOURCES: Readonly<Record<string, number>> = {
  world_row0: 4, // world from avatar
  world_row1: 4,
  world_row2: 4,
  world_quat_wxyz: 4,
  group_matrix_row0: 4, // by group: mesh from binding mesh
  group_matrix_row1: 4,
  group_matrix_row2: 4,
  group_rotation_row0: 4,
  group_rotation_row1: 4,
  group_rotation_row2: 4,
  camera_row0: 4, // camera from world
  camera_row1: 4,
  camera_row2: 4,
  clip_row0: 4, // clip from world
  clip_row1: 4,
  clip_row2: 4,
  clip_row3: 4,
  eye: 4,
  tan_half_fov: 2,
  image_size: 2, // pixels
  // A light of the scene, as `Lighting.write` has it.
  ...rows("light_ambient", 9),
  ...rows("light_place", 4),
  ...rows("light_colour", 4),
  ...rows("light_turn_row", 3),
  ...rows("shadow_row", 4),
  shadow_offset: 4,
};

/** `count` values of four floats: NAME0, NAME1. */
function rows(name: string, count: number): Record<string, number> {
  return Object.fromEntries(Array.from({ length: count }, (_, row) => [name + row, 4]));
}

/** Whether passes read the posed mesh. */
export function bindMesh(passes: readonly Pass[]): boolean {
  return passes.some((one) => "Mesh" in one.buffers);
}
