// Where the shadow map of a light has a point.

import { SHADOW_SIZE } from "../made/constants.js";

const NEAREST = 1.05; // radii: a point light within what it lights has no map
const UPRIGHT = 0.9; // of a light's axis: above it, another direction is up
const AXIS = new Float64Array(3);
const ACROSS = new Float64Array(3);
const DOWN = new Float64Array(3);

/**
 * Writes [4, 4] column, row, distance and w of a map that holds the sphere of `radius` about `centre` [3]. `light`:
 * direction and 0, or position and 1. false: there is none.
 */
export function setShadowRows(rows: Float64Array, light: Float64Array, centre: Float64Array, radius: number): boolean {
  const point = light[3] === 1;
  for (let i = 0; i < 3; i++) AXIS[i] = (light[i] as number) - (point ? (centre[i] as number) : 0);
  const distance = Math.sqrt(dot(AXIS, AXIS));
  if (!(distance > (point ? NEAREST * radius : 0))) return false;
  for (let i = 0; i < 3; i++) AXIS[i] = (AXIS[i] as number) / distance;
  setAcross();
  const origin = point ? light : centre;
  const middle = SHADOW_SIZE / 2 - 0.5;
  const scale = ((SHADOW_SIZE / 2) * (point ? Math.sqrt(distance * distance - radius * radius) : 1)) / radius;
  for (let i = 0; i < 3; i++) {
    rows[12 + i] = point ? -(AXIS[i] as number) : 0;
    rows[8 + i] = -(AXIS[i] as number);
    rows[i] = scale * (ACROSS[i] as number) + middle * (rows[12 + i] as number);
    rows[4 + i] = scale * (DOWN[i] as number) + middle * (rows[12 + i] as number);
  }
  const along = dot(AXIS, origin);
  rows[15] = point ? along : 1;
  rows[11] = point ? along : along + radius;
  rows[3] = middle * (rows[15] as number) - scale * dot(ACROSS, origin);
  rows[7] = middle * (rows[15] as number) - scale * dot(DOWN, origin);
  return true;
}

/** ACROSS and DOWN, at right angles to AXIS. */
function setAcross(): void {
  const x = AXIS[0] as number, y = AXIS[1] as number, z = AXIS[2] as number;
  const upright = Math.abs(y) < UPRIGHT;
  ACROSS[0] = upright ? z : 0; // up x axis
  ACROSS[1] = upright ? 0 : -z;
  ACROSS[2] = upright ? -x : y;
  const length = Math.sqrt(dot(ACROSS, ACROSS));
  for (let i = 0; i < 3; i++) ACROSS[i] = (ACROSS[i] as number) / length;
  const a = ACROSS[0] as number, b = ACROSS[1] as number, c = ACROSS[2] as number;
  DOWN[0] = b * z - c * y;
  DOWN[1] = c * x - a * z;
  DOWN[2] = a * y - b * x;
}

function dot(a: Float64Array, b: Float64Array): number {
  return (a[0] as number) * (b[0] as number) + (a[1] as number) * (b[1] as number) + (a[2] as number) * (b[2] as number);
}
