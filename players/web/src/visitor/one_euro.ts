// The 1€ filter: Casiez, Roussel and Vogel, "1€ Filter: A Simple Speed-based Low-pass Filter for Noisy Input in Interactive
// Systems", CHI 2012. Where a value rests, it is smoothed much; where it moves fast, little, so that it does not lag.

const SPEED_CUTOFF_HZ = 1; // of the speed itself, as published

/** How much is smoothed. */
export interface Smoothing {
  /** Cutoff of a value that rests, Hz: lower is calmer. */
  readonly restHz: number;
  /** Cutoff added for each unit a second of speed: higher lags less. */
  readonly hzPerSpeed: number;
}

/** Smooths some values, each by itself. */
export class OneEuro {
  private readonly values: Float64Array;
  private readonly speeds: Float64Array;
  private last = NaN; // seconds

  /** `smoothing`: of each value. */
  constructor(private readonly smoothing: readonly Smoothing[]) {
    this.values = new Float64Array(smoothing.length);
    this.speeds = new Float64Array(smoothing.length);
  }

  /** Forgets what it saw. */
  reset(): void {
    this.last = NaN;
  }

  /** Smooths the first values of a list in place. The first time, and where `seconds` does not rise, they stay. */
  smooth(values: Float32Array, seconds: number): void {
    const step = seconds - this.last;
    this.last = seconds;
    for (let i = 0; i < this.values.length; i++) {
      const raw = values[i]!;
      const before = this.values[i]!;
      if (!(step > 0)) {
        this.values[i] = raw;
        this.speeds[i] = 0;
        continue;
      }
      const { restHz, hzPerSpeed } = this.smoothing[i]!;
      const speed = mixed(this.speeds[i]!, (raw - before) / step, share(SPEED_CUTOFF_HZ, step));
      values[i] = this.values[i] = mixed(before, raw, share(restHz + hzPerSpeed * Math.abs(speed), step));
      this.speeds[i] = speed;
    }
  }
}

/** The share of a new value in a low-pass filter: 1 / (1 + tau / step). */
function share(cutoffHz: number, step: number): number {
  return 1 / (1 + 1 / (2 * Math.PI * cutoffHz * step));
}

function mixed(from: number, to: number, part: number): number {
  return from + part * (to - from);
}
