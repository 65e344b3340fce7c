import type { DrivingFrame } from "../pose/arkit.js";
import { setGaze } from "./gaze.js";

const EYE_RATE = 18; // 1/s: the eyes are there in about 0.2 s
const HEAD_RATE = 4.5; // the head in about 1 s
const ATTENTION_RATE = 6; // how fast the gaze is caught, and let go
const HEAD_SHARE = 0.45; // of the way to the target
const MOST = [0.9, 0.5] as const; // radians of the gaze from the middle: yaw, pitch
const MOST_IN_HEAD = [0.45, 0.32] as const; // of the eyes
const STILL = 1e-4;

/** Turns eyes and head to a target: the eyes at once, the head later and less. */
export class Look {
  private readonly target = new Float64Array(2); // yaw, pitch
  private readonly eyes = new Float64Array(4); // of the gaze: yaw, pitch, and their speeds
  private readonly head = new Float64Array(4);
  private readonly attention = new Float64Array(2); // 0 to 1, and its speed
  private readonly inHead = new Float64Array(2);
  private wanted = 0;

  /**
   * Looks there from the next step on: radians from straight ahead in the person's frame, `yaw` to the person's left,
   * `pitch` up. Angles that no neck reaches are cut.
   */
  at(yaw: number, pitch: number): void {
    this.target[0] = limited(yaw, MOST[0]);
    this.target[1] = limited(pitch, MOST[1]);
    this.wanted = 1;
  }

  /** Lets the gaze go back to what it did. */
  release(): void {
    this.wanted = 0;
  }

  /** Whether it turns eyes and head at all. */
  get active(): boolean {
    return this.attention[0] !== 0 || this.wanted !== 0;
  }

  /** Goes on by some seconds. One long step does what many short ones do. True: it still moves. */
  step(seconds: number): boolean {
    if (!this.active) return false;
    let moves = follow(this.attention, 0, this.wanted, ATTENTION_RATE, seconds);
    for (let axis = 0; axis < 2; axis++) {
      const to = this.target[axis] as number;
      if (follow(this.eyes, axis, to, EYE_RATE, seconds)) moves = true;
      if (follow(this.head, axis, HEAD_SHARE * to, HEAD_RATE, seconds)) moves = true;
    }
    return moves;
  }

  /** Adds it to a frame whose gaze is that of idle life, or zero: the more attention, the less of that remains. */
  add(frame: DrivingFrame): void {
    const part = this.attention[0] as number;
    if (part === 0) return;
    for (let axis = 0; axis < 2; axis++) {
      const before = -(frame.leftEye[axis] as number);
      const head = (frame.head[axis] as number) + part * (this.head[axis] as number);
      const eyes = limited((this.eyes[axis] as number) - head, MOST_IN_HEAD[axis] as number);
      frame.head[axis] = head;
      this.inHead[axis] = before + part * (eyes - before);
    }
    setGaze(frame, this.inHead);
  }
}

/** A critically damped spring, solved: state[at] moves to a target, state[at + half] is its speed. False: it rests there. */
function follow(state: Float64Array, at: number, to: number, rate: number, seconds: number): boolean {
  const speed = at + state.length / 2;
  const away = (state[at] as number) - to;
  const decay = Math.exp(-rate * seconds), change = (state[speed] as number) + rate * away;
  const left = (away + change * seconds) * decay, v = (change - rate * (away + change * seconds)) * decay;
  const rests = Math.abs(left) < STILL && Math.abs(v) < STILL;
  state[at] = rests ? to : to + left;
  state[speed] = rests ? 0 : v;
  return !rests;
}

function limited(value: number, most: number): number {
  return Math.min(Math.max(value, -most), most) || 0; // NaN is straight ahead
}
