// Reads a face: MediaPipe's scores and points, less the same face at rest -> ARKit weights. The table is learnt on drawn
// people (tools/visitor_map); points say what MediaPipe's own scores hardly see: brows, a sneer, a frown, a stretched mouth.

import { LANDMARKS, SCALES, SCORE_NAMES, STABLE, TABLE } from "../made/face_map.js";
import { ARKIT_NAMES } from "../pose/arkit.js";
import { Alignment } from "./alignment.js";
import { setAngles, setRotationOf } from "./head.js";
import type { Sight } from "./landmarker.js";

const SCORES = SCORE_NAMES.length;
const POINTS = SCORES; // where points begin in what is measured
const ROTATION = POINTS + 3 * LANDMARKS.length;
const TURN = SCORES + 2 * LANDMARKS.length; // where the alignment's turn lies in a row of the table
const FEATURES = TURN + 3;
const ROWS = ARKIT_NAMES.length + 3; // of the table: weights, then yaw, pitch, roll

/** How many numbers `measure` writes. */
export const MEASURED = ROTATION + 9;

/** Writes scores, points and the head's rotation of a face into `out` [MEASURED]; false: there is no face. */
export function measure(sight: Sight, aspect: number, out: Float64Array): boolean {
  const scores = sight.faceBlendshapes[0]?.categories;
  const matrix = sight.facialTransformationMatrixes[0]?.data;
  const points = sight.faceLandmarks[0];
  if (scores === undefined || matrix === undefined || points === undefined) return false;
  for (let i = 0; i < SCORES; i++) out[i] = scores[i]?.score ?? 0;
  const rotation = out.subarray(ROTATION);
  setRotationOf(matrix, rotation);
  LANDMARKS.forEach((landmark, i) => {
    const { x, y, z } = points[landmark] as { x: number; y: number; z: number };
    for (let axis = 0; axis < 3; axis++) { // head from camera; a picture's y goes down, its z away
      out[POINTS + 3 * i + axis] = rotation[axis]! * x * aspect - rotation[3 + axis]! * y - rotation[6 + axis]! * z * aspect;
    }
  });
  centre(out.subarray(POINTS, ROTATION));
  return true;
}

/** The stable points' middle becomes 0, and their mean distance from it 1. */
function centre(points: Float64Array): void {
  let size = 0;
  for (let axis = 0; axis < 3; axis++) {
    let middle = 0;
    for (const point of STABLE) middle += points[3 * point + axis]! / STABLE.length;
    for (let at = axis; at < points.length; at += 3) points[at]! -= middle;
  }
  for (const point of STABLE) size += Math.hypot(points[3 * point]!, points[3 * point + 1]!, points[3 * point + 2]!) / STABLE.length;
  for (let at = 0; at < points.length; at++) points[at]! /= size || 1;
}

/** Weights of one visitor, whose face at rest is known. */
export class FaceReader {
  private readonly alignment: Alignment;
  private readonly features = new Float64Array(FEATURES);

  /** `rest`: what was measured of the neutral face, [MEASURED]. */
  constructor(private readonly rest: Float64Array) {
    this.alignment = new Alignment(rest.subarray(POINTS, ROTATION), STABLE);
  }

  /** Writes the 52 weights, 0 to 1, and the head's yaw, pitch and roll in radians, of what was measured. */
  read(measured: Float64Array, channels: Float32Array): void {
    const points = measured.subarray(POINTS, ROTATION);
    for (let i = 0; i < SCORES; i++) this.features[i] = measured[i]! - this.rest[i]!;
    this.alignment.fit(points);
    for (let i = 0; i < LANDMARKS.length; i++) {
      this.features[SCORES + 2 * i] = this.alignment.left(points, i, 0);
      this.features[SCORES + 2 * i + 1] = this.alignment.left(points, i, 1);
    }
    for (let axis = 0; axis < 3; axis++) this.features[TURN + axis] = this.alignment.turn(axis);
    setAngles(channels, ARKIT_NAMES.length, this.rest.subarray(ROTATION), measured.subarray(ROTATION));
    for (let row = 0; row < ROWS; row++) {
      let sum = 0;
      for (let i = 0; i < FEATURES; i++) sum += TABLE[row * FEATURES + i]! * this.features[i]!;
      sum *= SCALES[row]!;
      if (row < ARKIT_NAMES.length) channels[row] = Math.min(Math.max(sum, 0), 1);
      else channels[row]! += sum; // MediaPipe takes a part of a smile or a brow for a turn of the head
    }
  }
}
