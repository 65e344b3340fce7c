import type { Avatar, ClipData } from "../avatar.js";
import { AvatarError } from "../errors.js";
import { interpolate } from "./interpolate.js";
import type { Pose } from "./pose.js";

const AT_FRAME = 1e-6; // of a frame: nearer times are that frame
const PARTS = new Float64Array(2); // of the first and of the second frame

/** A recorded motion of an avatar. */
export class Clip {
  readonly name: string;
  /** Frames a second. */
  readonly fps: number;
  /** From the first frame to the last. */
  readonly seconds: number;
  private readonly data: ClipData;

  /** Clip `index` of `avatar`. Throws AvatarError if there is no such clip. */
  constructor(avatar: Avatar, index: number) {
    const data = avatar.clips[index];
    if (data === undefined) {
      const last = avatar.clips.length - 1;
      const have = last < 0 ? "this avatar has none" : `the last one is clip ${last}`;
      throw new AvatarError(`there is no clip ${index}; ${have}`, { owner: avatar.name, field: "clips" });
    }
    this.data = data;
    this.name = data.name;
    this.fps = data.fps;
    this.seconds = (data.frames - 1) / data.fps;
  }

  /**
   * Writes the pose at a time into `out`, a pose of the same avatar; times beyond the ends are those of the ends.
   * Frames are exact. Between two frames weights are linear. A matrix is split into a rotation and what remains (Gram-
   * Schmidt: scale and shear); quaternions are mixed and normalised, the remainder and the translation are linear.
   */
  pose(seconds: number, out: Pose): void {
    const { frames } = this.data;
    const place = Math.min(Math.max(seconds * this.fps, 0), frames - 1) || 0; // NaN is the beginning
    const nearest = Math.round(place);
    const exact = Math.abs(place - nearest) < AT_FRAME;
    const first = exact ? nearest : Math.floor(place);
    const second = exact ? first : first + 1;
    PARTS[1] = exact ? 0 : place - first;
    PARTS[0] = 1 - (PARTS[1] as number);
    linear(out.expressionWeights, this.data.expressionWeights, first, second);
    linear(out.lateWeights, this.data.lateWeights, first, second);
    matrices(out.jointDelta, this.data.jointDelta, first, second);
    matrices(out.worldFromAvatar, this.data.worldFromAvatar, first, second);
  }
}

function linear(out: Float32Array, rows: Float32Array, first: number, second: number): void {
  const keep = PARTS[0] as number, part = PARTS[1] as number;
  for (let i = 0, a = first * out.length, b = second * out.length; i < out.length; i++, a++, b++) {
    out[i] = keep * (rows[a] as number) + part * (rows[b] as number);
  }
}

function matrices(out: Float64Array, rows: Float32Array, first: number, second: number): void {
  for (let at = 0, a = first * out.length, b = second * out.length; at < out.length; at += 16) {
    interpolate(out, at, rows, a + at, rows, b + at, PARTS);
  }
}
