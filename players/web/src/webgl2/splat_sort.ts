// Stage sort on the CPU: a stable radix sort of (key, id) pairs.

const DIGITS = 1 << 16;
const NOT_DRAWN = 0xffffffff; // key of splats without radius; they sort last

/** Sorts up to `capacity` pairs; allocates nothing when it runs. */
export class SplatSort {
  private readonly keys: Uint32Array;
  private readonly ids: Uint32Array;
  private readonly low = new Uint32Array(DIGITS);
  private readonly high = new Uint32Array(DIGITS);

  constructor(private readonly capacity: number) {
    this.keys = new Uint32Array(capacity);
    this.ids = new Uint32Array(capacity);
  }

  /** Sorts the pairs at `first` of `words` by key, ties by place; returns how many are drawn. */
  run(words: Uint32Array, first: number): number {
    const { keys, ids, low, high } = this;
    low.fill(0);
    high.fill(0);
    let drawn = 0;
    for (let i = 0, at = first; i < this.capacity; i++, at += 2) {
      const key = words[at] as number;
      if (key === NOT_DRAWN) continue;
      low[key & 0xffff]!++;
      high[key >>> 16]!++;
      drawn++;
    }
    begins(low);
    begins(high);
    for (let i = 0, at = first; i < this.capacity; i++, at += 2) {
      const key = words[at] as number;
      if (key === NOT_DRAWN) continue;
      const to = low[key & 0xffff]!++;
      keys[to] = key;
      ids[to] = words[at + 1] as number;
    }
    for (let i = 0; i < drawn; i++) {
      const key = keys[i] as number;
      const to = first + 2 * high[key >>> 16]!++;
      words[to] = key;
      words[to + 1] = ids[i] as number;
    }
    return drawn;
  }
}

/** Counts become the places where each digit begins. */
function begins(counts: Uint32Array): void {
  let sum = 0;
  for (let digit = 0; digit < DIGITS; digit++) {
    const count = counts[digit] as number;
    counts[digit] = sum;
    sum += count;
  }
}
