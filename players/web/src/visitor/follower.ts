// From what MediaPipe sees to ARKit channels: less the visitor's neutral face, smoothed, mirrored.

import { ARKIT_NAMES, CHANNELS } from "../pose/arkit.js";
import { FaceReader, measure, MEASURED } from "./face_reader.js";
import type { Sight } from "./landmarker.js";
import type { Seen } from "./messages.js";
import { Neutral } from "./neutral.js";
import { OneEuro, type Smoothing } from "./one_euro.js";

const SHAPES = ARKIT_NAMES.length;
const WEIGHT: Smoothing = { restHz: 2, hzPerSpeed: 3 }; // a speed of 1: from 0 to 1 in a second
const LID: Smoothing = { restHz: 4, hzPerSpeed: 6 }; // a blink takes a tenth of a second
const ANGLE: Smoothing = { restHz: 1.5, hzPerSpeed: 8 };
const SMOOTHING = CHANNELS.slice(0, SHAPES + 3).map((name) => (name.startsWith("eyeBlink") ? LID : ARKIT_NAMES.includes(name) ? WEIGHT : ANGLE));
const PARTNER = ARKIT_NAMES.map((name) => ARKIT_NAMES.indexOf(name.replace(/(Left|Right)$/, (side) => (side === "Left" ? "Right" : "Left"))));

/** Follows one face. */
export class Follower {
  private readonly measured = new Float64Array(MEASURED);
  private readonly neutral = new Neutral(MEASURED);
  private readonly filter = new OneEuro(SMOOTHING);
  private reader: FaceReader | null = null;

  /** `mirror`: left and right change places, as a mirror shows them. */
  constructor(private readonly mirror: boolean) {}

  /** Learns the neutral face anew. */
  learn(): void {
    this.neutral.forget();
    this.reader = null;
  }

  /**
   * Writes weights and the head's angles of what is seen at a time, in seconds, into `channels` [61]; the angles of the
   * eyes stay 0, so that eyes follow the weights. Without a face, and while it learns, nothing is written.
   */
  follow(sight: Sight, aspect: number, seconds: number, channels: Float32Array): Seen {
    if (!measure(sight, aspect, this.measured)) {
      this.filter.reset();
      return "away";
    }
    if (this.reader === null) {
      if (this.neutral.add(this.measured, seconds)) this.reader = new FaceReader(this.neutral.values.slice());
      return "learning";
    }
    this.reader.read(this.measured, channels);
    if (this.mirror) mirrored(channels);
    this.filter.smooth(channels, seconds);
    return "live";
  }
}

/** Left and right change places. */
function mirrored(channels: Float32Array): void {
  PARTNER.forEach((other, i) => {
    if (other <= i) return;
    const kept = channels[i]!;
    channels[i] = channels[other]!;
    channels[other] = kept;
  });
  channels[SHAPES] = -channels[SHAPES]!; // yaw
  channels[SHAPES + 2] = -channels[SHAPES + 2]!; // roll
}
