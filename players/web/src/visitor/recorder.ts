// Keeps what a visitor's face did, as a recording.

import { ARKIT_NAMES, CHANNELS, type DrivingFrame } from "../pose/arkit.js";
import { Recording } from "../pose/recording.js";

const SHORTEST = 1 / 250; // seconds between two frames

/** Gathers frames. */
export class FaceRecorder {
  private readonly times: number[] = [];
  private readonly channels: number[] = [];

  /** Adds a frame that was seen at a time in milliseconds; one without a newer time is left out. */
  add(frame: DrivingFrame, ms: number): void {
    const time = ms / 1000;
    if (this.times.length > 0 && !(time - (this.times[this.times.length - 1] as number) >= SHORTEST)) return;
    this.times.push(time);
    const values = [...frame.weights.subarray(0, ARKIT_NAMES.length), ...frame.head, ...frame.leftEye, ...frame.rightEye];
    this.channels.push(...values);
  }

  /** How many frames it has. */
  get frames(): number {
    return this.channels.length / CHANNELS.length;
  }

  /** What was recorded. Throws AvatarError without a frame. */
  recording(): Recording {
    const first = this.times[0] ?? 0;
    return new Recording(Float64Array.from(this.times, (time) => time - first), Float64Array.from(this.channels));
  }
}
