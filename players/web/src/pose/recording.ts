import { AvatarError } from "../errors.js";
import { CHANNELS, type DrivingFrame, setChannels } from "./arkit.js";

const WHOLE = 8e-4; // a rate so near to a whole number is that number: clocks of recorders drift
const DEFAULT_FPS = 30; // of a single frame

/** A recording of a face: frames at rising times. */
export class Recording {
  /** Seconds from the first frame to the last. */
  readonly seconds: number;
  /** Frames a second, from the median step. */
  readonly fps: number;
  private readonly mixed = new Float64Array(CHANNELS.length);
  private newest = 0; // the frame that was found last

  constructor(
    /** Seconds from the first frame, [F], rising. */
    readonly times: Float64Array,
    /** Channels of every frame, [F, 61], in the order of CHANNELS. */
    readonly channels: Float64Array,
    /** Channels that the file lacks; they are 0 throughout. */
    readonly missing: readonly string[] = [],
    /** How many records had no face and are left out. */
    readonly withoutFace = 0,
  ) {
    if (times.length === 0 || channels.length !== times.length * CHANNELS.length) {
      throw new AvatarError("has no frame with a face");
    }
    this.seconds = times[times.length - 1] as number;
    this.fps = rateOf(times);
  }

  /** How many frames it has. */
  get frames(): number {
    return this.times.length;
  }

  /** Writes the frame at a time, linear between two frames, into `frame`; beyond the ends, the frame at the end. */
  sample(seconds: number, frame: DrivingFrame): void {
    const count = CHANNELS.length;
    const at = this.find(seconds);
    const next = Math.min(at + 1, this.times.length - 1);
    const begin = this.times[at] as number;
    const step = (this.times[next] as number) - begin;
    const part = step > 0 ? Math.min(Math.max((seconds - begin) / step, 0), 1) || 0 : 0;
    for (let c = 0, a = at * count, b = next * count; c < count; c++, a++, b++) {
      this.mixed[c] = (1 - part) * (this.channels[a] as number) + part * (this.channels[b] as number);
    }
    setChannels(frame, this.mixed);
  }

  /** The last frame that is not later; the first one if there is none. Times mostly rise from call to call. */
  private find(seconds: number): number {
    let at = this.newest;
    if (!((this.times[at] as number) <= seconds)) at = 0;
    while (at + 1 < this.times.length && (this.times[at + 1] as number) <= seconds) at++;
    this.newest = at;
    return at;
  }
}

function rateOf(times: Float64Array): number {
  const steps = times.subarray(1).map((time, i) => time - (times[i] as number)).filter((step) => step > 0).sort();
  if (steps.length === 0) return DEFAULT_FPS;
  const middle = steps.length >> 1;
  const odd = steps.length % 2 === 1;
  const median = odd ? (steps[middle] as number) : ((steps[middle - 1] as number) + (steps[middle] as number)) / 2;
  const rate = 1 / median;
  const whole = Math.round(rate);
  return whole > 0 && Math.abs(rate / whole - 1) < WHOLE ? whole : rate;
}
