// What a host draws with: its camera as ours, its target, its depth.

import { Camera, type Numbers } from "../camera.js";

/** Where z / w of visible points lies: OpenGL's clip space has -1..1, all others 0..1. */
export type ClipDepth = "minus_one_to_one" | "zero_to_one";

const PROJECTION = new Float64Array(16);

/** The camera and the target of one picture of a host. Its methods allocate nothing. */
export class EngineView {
  /** Of the whole target, also where the host draws into a part of it. */
  readonly camera = new Camera();
  /** The part that the host draws into: x, y, width, height in pixels; y counts from row 0 of the target. */
  readonly viewport = new Int32Array(4);
  /** The target holds linear light. */
  linear = false;
  /** Near points have larger values in the depth buffer. */
  reversed = false;

  setViewport(x: number, y: number, width: number, height: number): void {
    this.viewport[0] = x;
    this.viewport[1] = y;
    this.viewport[2] = width;
    this.viewport[3] = height;
  }

  /**
   * Takes the host's camera: `view` and `projection` [4, 4] column-major, as for `Camera.fromOpengl`. The target has
   * `width` x `height` pixels; the viewport must be set.
   * `firstRow` says what row 0 of the target shows. Throws AvatarError for a projection without perspective.
   */
  setCamera(view: Numbers, projection: Numbers, clipDepth: ClipDepth, firstRow: "top" | "bottom", width: number, height: number): void {
    const { camera } = this;
    this.setProjection(projection, firstRow, width, height);
    camera.fromOpengl(view, PROJECTION, width, height);
    const clip = camera.clipFromWorld;
    const size = Math.abs(projection[11] as number);
    for (let column = 0; column < 4; column++) {
      let z = 0;
      for (let k = 0; k < 4; k++) z += (projection[4 * k + 2] as number) * (view[4 * column + k] as number);
      z /= size;
      clip[8 + column] = clipDepth === "zero_to_one" ? z : 0.5 * (z + (clip[12 + column] as number));
    }
    if (firstRow === "bottom") {
      for (let column = 4; column < 8; column++) {
        clip[column] = -(clip[column] as number);
        camera.cameraFromWorld[column] = -(camera.cameraFromWorld[column] as number);
      }
    }
  }

  /** Whether the host draws into a part of its target. */
  get partial(): boolean {
    const { viewport, camera } = this;
    return viewport[0] !== 0 || viewport[1] !== 0 || viewport[2] !== camera.width || viewport[3] !== camera.height;
  }

  /** Writes the host's projection, widened to the whole target, into PROJECTION. */
  private setProjection(projection: Numbers, firstRow: "top" | "bottom", width: number, height: number): void {
    const { viewport } = this;
    const x = viewport[0] as number, y = viewport[1] as number, w = viewport[2] as number, h = viewport[3] as number;
    const shiftX = (2 * x + w) / width - 1;
    const shiftY = firstRow === "bottom" ? (2 * y + h) / height - 1 : 1 - (2 * y + h) / height;
    for (let column = 0; column < 4; column++) {
      const at = 4 * column;
      const along = projection[at + 3] as number;
      PROJECTION[at] = ((projection[at] as number) * w) / width + along * shiftX;
      PROJECTION[at + 1] = ((projection[at + 1] as number) * h) / height + along * shiftY;
      PROJECTION[at + 2] = projection[at + 2] as number;
      PROJECTION[at + 3] = along;
    }
  }
}

/** Writes `Instance.place` from the column-major matrix of a node. `mirror`: the host's scene is left-handed. */
export function setPlace(place: Float64Array, columns: Numbers, mirror: boolean): void {
  for (let row = 0; row < 4; row++) {
    place[4 * row] = (mirror ? -1 : 1) * (columns[row] as number);
    for (let column = 1; column < 4; column++) place[4 * row + column] = columns[4 * column + row] as number;
  }
}

const SEEN = new Camera();

/** A host's camera, as for `setCamera`, of an image of `height` pixels. It is the same object every time. */
export function seenAs(view: Numbers, projection: Numbers, height: number): Camera {
  SEEN.fromOpengl(view, projection, height, height); // heights and levels do not depend on the width
  return SEEN;
}
