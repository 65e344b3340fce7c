// Learns what a visitor's face is at rest: the median of what is seen in two seconds, so that a blink does not count.

const SECONDS = 2;
const FEWEST = 8; // pictures

/** Gathers vectors of `count` numbers over time. */
export class Neutral {
  /** The median, once `add` returned true. */
  readonly values: Float64Array;
  private readonly seen: Float64Array[] = [];
  private begin = NaN; // seconds

  constructor(count: number) {
    this.values = new Float64Array(count);
  }

  /** Takes what is seen at a time, in seconds. True: it was enough. */
  add(values: Float64Array, seconds: number): boolean {
    if (this.seen.length === 0) this.begin = seconds;
    this.seen.push(values.slice());
    if (seconds - this.begin < SECONDS || this.seen.length < FEWEST) return false;
    for (let i = 0; i < this.values.length; i++) this.values[i] = median(this.seen.map((one) => one[i]!));
    this.forget();
    return true;
  }

  /** Begins anew. */
  forget(): void {
    this.seen.length = 0;
  }
}

function median(values: number[]): number {
  values.sort((a, b) => a - b);
  const middle = values.length >> 1;
  return values.length % 2 === 1 ? values[middle]! : (values[middle - 1]! + values[middle]!) / 2;
}
