// Levels of detail: how tall an avatar stands in an image, and which level serves that height (SPEC.md, section 18).

import type { Framing, LevelInfo } from "./avatar.js";
import type { Numbers } from "./camera.js";

const MARGIN = 1.1; // of a border between two levels: an avatar that stands at it does not flicker

/**
 * The physical pixels that a length of `whole.size[1]` covers, facing the camera, at `whole.target`; how avatar and
 * camera are turned does not matter. `place` [4, 4] places the avatar, `clip` [4, 4] is clip from world, both row-major.
 * Infinite where the target is not before the camera. Allocates nothing.
 */
export function heightPx(whole: Framing["whole"], place: Numbers, clip: Numbers, imageHeightPx: number): number {
  let w = clip[15] as number, rowY = 0;
  for (let i = 0; i < 3; i++) {
    let at = place[4 * i + 3] as number;
    for (let k = 0; k < 3; k++) at += (place[4 * i + k] as number) * (whole.target[k] as number);
    w += (clip[12 + i] as number) * at;
    rowY += (clip[4 + i] as number) ** 2;
  }
  const scale = Math.cbrt(Math.abs(determinant(place)));
  const height = (Math.sqrt(rowY) * scale * whole.size[1] * imageHeightPx) / 2 / w;
  return w > 0 && Number.isFinite(height) ? height : Infinity;
}

/** Of the 3x3 part of a row-major [4, 4]. */
function determinant(m: Numbers): number {
  const a = m[0] as number, b = m[1] as number, c = m[2] as number;
  const d = m[4] as number, e = m[5] as number, f = m[6] as number;
  const g = m[8] as number, h = m[9] as number, k = m[10] as number;
  return a * (e * k - f * h) - b * (d * k - f * g) + c * (d * h - e * g);
}

/** The coarsest level that serves a height: level i from 1 on serves heights up to its `heightPx`. */
export function levelFor(levels: readonly LevelInfo[], height: number): number {
  let best = 0;
  for (let i = 1; i < levels.length; i++) {
    const most = (levels[i] as LevelInfo).heightPx;
    if (most !== null && height <= most) best = i;
  }
  return best;
}

/** The level to show after `level`: it stays where the height is within a tenth of its borders. */
export function nextLevel(levels: readonly LevelInfo[], height: number, level: number): number {
  const stays = levelFor(levels, height * MARGIN) <= level && level <= levelFor(levels, height / MARGIN);
  return stays ? level : levelFor(levels, height);
}
