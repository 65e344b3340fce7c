// Arrays of the stages to and from the buffers Splats, Sh and Projected of a chunk.

import type { Run } from "../pack/model.js";
import type { Numbers } from "./reference.js";

/** Where component k of a row lies among the floats of `count` rows. */
export interface Place {
  readonly components: number;
  at(row: number, k: number, count: number): number;
}

/** Components that follow each other in a plane of float4. */
function inPlane(plane: number, first: number, components: number): Place {
  return { components, at: (row, k, count) => 4 * (plane * count + row) + first + k };
}

/** One component of each of the planes that follow. */
function acrossPlanes(plane: number, component: number, components: number): Place {
  return { components, at: (row, k, count) => 4 * ((plane + k) * count + row) + component };
}

/** [N, terms, 3]: a plane of floats for each. */
export function shPlace(terms: number): Place {
  return { components: 3 * terms, at: (row, k, count) => k * count + row };
}

const SCALE = acrossPlanes(2, 3, 3);

/** How many planes a buffer has, and where its arrays lie. */
export const LAYOUTS = {
  Splats: {
    planes: 5,
    places: {
      mean: inPlane(0, 0, 3),
      opacity_logit: inPlane(0, 3, 1),
      opacity: inPlane(0, 3, 1),
      quat_wxyz: inPlane(1, 0, 4),
      log_scale: SCALE,
      scale: SCALE,
      sh_rotation: { components: 9, at: (row, k, count) => 4 * ((2 + Math.floor(k / 3)) * count + row) + (k % 3) },
    } as Readonly<Record<string, Place>>,
  },
  Projected: {
    planes: 3,
    places: {
      centre: inPlane(0, 0, 2),
      depth: inPlane(0, 2, 1),
      opacity: inPlane(0, 3, 1),
      conic: inPlane(1, 0, 3),
      radius: inPlane(1, 3, 1),
      rgb: inPlane(2, 0, 3),
    } as Readonly<Record<string, Place>>,
  },
} as const;

/** Writes the rows of a chunk of an array into the chunk's floats. */
export function putRows(floats: Float32Array, { components, at }: Place, values: Numbers, { first, count }: Run): void {
  for (let row = 0; row < count; row++) {
    for (let k = 0; k < components; k++) floats[at(row, k, count)] = Number(values[(first + row) * components + k]);
  }
}

/** Reads the rows of a chunk of an array from the chunk's floats. */
export function takeRows(floats: Float32Array, { components, at }: Place, out: Float32Array, { first, count }: Run): void {
  for (let row = 0; row < count; row++) {
    for (let k = 0; k < components; k++) out[(first + row) * components + k] = floats[at(row, k, count)] as number;
  }
}
