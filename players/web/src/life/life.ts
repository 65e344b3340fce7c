import type { Avatar } from "../avatar.js";
import { multiply } from "../pose/affine.js";
import { drivingFrame } from "../pose/arkit.js";
import { Driver } from "../pose/driver.js";
import { interpolate } from "../pose/interpolate.js";
import { Pose } from "../pose/pose.js";
import { idle } from "./idle.js";
import { Look } from "./look.js";

const FADE_S = 0.5; // in and out
const LONGEST_STEP_S = 0.25; // a page that was out of sight goes on where it stopped
const FIRST_STEP_S = 1 / 60; // after rest: nobody asked for frames meanwhile

/**
 * What keeps an avatar alive while nothing plays: idle life and a gaze that follows a target, added to a pose.
 *
 * Life only adds to what the pose says: weights that a person has set stay, joints turn on from where they are. What is
 * added never drives a weight beyond its trained range (eyelids: 0 to 1), unless the pose is there already. An avatar
 * that ARKit cannot drive keeps still.
 */
export class Life {
  /** Breathes, blinks and looks about; fades in and out. False while a clip plays or a face is tracked. */
  idle = false;
  /** A target for eyes and head, such as the pointer. */
  readonly look = new Look();
  private readonly driver: Driver | null;
  private readonly frame = drivingFrame();
  private readonly added: Pose;
  private readonly base: Pose; // the newest, crossfaded
  private readonly from: Pose; // where the crossfade begins
  private readonly parts = Float64Array.of(0, 1); // of `from` and of the given pose
  private part = 0; // of idle life, 0 to 1
  private crossed = 1; // of the crossfade, 0 to 1
  private last = NaN;
  private moves = false; // at the last call

  /** `seed` makes persons differ. */
  constructor(
    private readonly avatar: Avatar,
    private readonly seed = 0,
  ) {
    this.driver = avatar.driving === null ? null : new Driver(avatar);
    this.added = new Pose(avatar);
    this.base = new Pose(avatar);
    this.from = new Pose(avatar);
  }

  /** The pose of the next call comes from elsewhere (a clip has ended): it fades in over what was shown last. */
  crossfade(): void {
    this.from.copy(this.base);
    this.crossed = 0;
  }

  /**
   * Writes the pose with life at a time into `out`, another pose than `pose`. Seconds are of any clock that never goes
   * back. True: it moves on, so another frame should follow.
   */
  pose(seconds: number, pose: Pose, out: Pose): boolean {
    const longest = this.moves ? LONGEST_STEP_S : FIRST_STEP_S;
    const past = Math.min(Math.max(seconds - this.last, 0), longest) || 0;
    this.last = seconds;
    const fading = this.fade(past / FADE_S, pose);
    out.copy(this.base);
    const looking = this.driver !== null && this.look.step(past);
    if (this.driver !== null && (this.part > 0 || this.look.active)) {
      this.drive(seconds, this.driver);
      this.add(out);
    }
    this.moves = fading || looking || this.part > 0;
    return this.moves;
  }

  private fade(step: number, pose: Pose): boolean {
    const lives = this.idle && this.driver !== null;
    this.part = Math.min(Math.max(this.part + (lives ? step : -step), 0), 1);
    if (this.crossed === 1) {
      this.base.copy(pose);
      return lives && this.part < 1;
    }
    this.crossed = Math.min(this.crossed + step, 1);
    this.parts[1] = smooth(this.crossed);
    this.parts[0] = 1 - this.parts[1];
    const { base, from, parts } = this;
    linear(base.expressionWeights, from.expressionWeights, pose.expressionWeights, parts);
    linear(base.lateWeights, from.lateWeights, pose.lateWeights, parts);
    matrices(base.jointDelta, from.jointDelta, pose.jointDelta, parts);
    matrices(base.worldFromAvatar, from.worldFromAvatar, pose.worldFromAvatar, parts);
    return true;
  }

  private drive(seconds: number, driver: Driver): void {
    const { frame } = this;
    idle(seconds, this.seed, frame);
    const part = smooth(this.part);
    if (part < 1) {
      for (let i = 0; i < frame.weights.length; i++) frame.weights[i] = part * (frame.weights[i] as number);
      for (let i = 0; i < 3; i++) {
        frame.head[i] = part * (frame.head[i] as number);
        frame.leftEye[i] = part * (frame.leftEye[i] as number);
        frame.rightEye[i] = part * (frame.rightEye[i] as number);
      }
    }
    this.look.add(frame);
    driver.pose(frame, this.added);
  }

  private add(out: Pose): void {
    const { added, avatar } = this;
    for (let i = 0; i < out.expressionWeights.length; i++) {
      const { range } = avatar.expressions[i] as Avatar["expressions"][number];
      raise(out.expressionWeights, added.expressionWeights, i, range[0], range[1]);
    }
    for (let i = 0; i < out.lateWeights.length; i++) raise(out.lateWeights, added.lateWeights, i, 0, 1);
    for (let at = 0; at < out.jointDelta.length; at += 16) turn(out.jointDelta, added.jointDelta, at);
    turn(out.worldFromAvatar, added.worldFromAvatar, 0);
  }
}

/** out[i] += more[i], within the range or where it was. */
function raise(out: Float32Array, more: Float32Array, i: number, low: number, high: number): void {
  const before = out[i] as number;
  const sum = before + (more[i] as number);
  out[i] = Math.min(Math.max(sum, Math.min(before, low)), Math.max(before, high));
}

/** out = out more, of rigid transforms; most joints do not move. */
function turn(out: Float64Array, more: Float64Array, at: number): void {
  if (more[at] !== 1 || more[at + 5] !== 1 || more[at + 10] !== 1) multiply(out, at, out, at, more, at);
}

function linear(out: Float32Array, first: Float32Array, second: Float32Array, parts: Float64Array): void {
  for (let i = 0; i < out.length; i++) {
    out[i] = (parts[0] as number) * (first[i] as number) + (parts[1] as number) * (second[i] as number);
  }
}

function matrices(out: Float64Array, first: Float64Array, second: Float64Array, parts: Float64Array): void {
  for (let at = 0; at < out.length; at += 16) interpolate(out, at, first, at, second, at, parts);
}

function smooth(part: number): number {
  return part * part * (3 - 2 * part);
}
