// Arrays of the stages to and from the planes of Splats, Sh and Projected.

import type { Numbers } from "./reference.js";

interface Place {
  readonly plane: number;
  readonly first: number; // component
  readonly components: number;
  readonly byComponent?: boolean; // component k lies in plane + k, at `first`
}

export const SPLAT_PLANES = 5, PROJECTED_PLANES = 3;
const SCALE: Place = { plane: 2, first: 3, components: 3, byComponent: true };

export const SPLAT_PLACES: Readonly<Record<string, Place>> = {
  mean: { plane: 0, first: 0, components: 3 },
  opacity_logit: { plane: 0, first: 3, components: 1 },
  opacity: { plane: 0, first: 3, components: 1 },
  quat_wxyz: { plane: 1, first: 0, components: 4 },
  log_scale: SCALE,
  scale: SCALE,
};
export const PROJECTED_PLACES: Readonly<Record<string, Place>> = {
  centre: { plane: 0, first: 0, components: 2 },
  depth: { plane: 0, first: 2, components: 1 },
  opacity: { plane: 0, first: 3, components: 1 },
  conic: { plane: 1, first: 0, components: 3 },
  radius: { plane: 1, first: 3, components: 1 },
  rgb: { plane: 2, first: 0, components: 3 },
};

function index(place: Place, row: number, k: number, count: number): number {
  const plane = place.byComponent ? place.plane + k : place.plane;
  return 4 * (plane * count + row) + place.first + (place.byComponent ? 0 : k);
}

/** Writes rows first .. first + count of an array into planes. */
export function putPlanes(planes: Float32Array, place: Place, values: Numbers, first: number, count: number): void {
  for (let row = 0; row < count; row++) {
    for (let k = 0; k < place.components; k++) {
      planes[index(place, row, k, count)] = Number(values[(first + row) * place.components + k]);
    }
  }
}

/** Reads an array of planes into rows first .. first + count of `out`. */
export function takePlanes(planes: Float32Array, place: Place, out: Float32Array, first: number, count: number): void {
  for (let row = 0; row < count; row++) {
    for (let k = 0; k < place.components; k++) {
      out[(first + row) * place.components + k] = planes[index(place, row, k, count)] as number;
    }
  }
}

/** sh_rotation [N, 3, 3] lies in the first three components of planes 2 to 4. */
export function putRotation(planes: Float32Array, values: Numbers, first: number, count: number): void {
  for (let row = 0; row < count; row++) {
    for (let k = 0; k < 9; k++) {
      planes[4 * ((2 + Math.floor(k / 3)) * count + row) + (k % 3)] = Number(values[9 * (first + row) + k]);
    }
  }
}

export function takeRotation(planes: Float32Array, out: Float32Array, first: number, count: number): void {
  for (let row = 0; row < count; row++) {
    for (let k = 0; k < 9; k++) {
      out[9 * (first + row) + k] = planes[4 * ((2 + Math.floor(k / 3)) * count + row) + (k % 3)] as number;
    }
  }
}

/** Sh holds plane 3 k + channel; arrays have [N, terms, 3]. */
export function putSh(planes: Float32Array, values: Numbers, terms: number, first: number, count: number): void {
  for (let row = 0; row < count; row++) {
    for (let t = 0; t < 3 * terms; t++) planes[t * count + row] = Number(values[(first + row) * 3 * terms + t]);
  }
}

export function takeSh(planes: Float32Array, out: Float32Array, terms: number, first: number, count: number): void {
  for (let row = 0; row < count; row++) {
    for (let t = 0; t < 3 * terms; t++) out[(first + row) * 3 * terms + t] = planes[t * count + row] as number;
  }
}
