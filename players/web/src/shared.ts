/** A part in something shared; `release` gives it back, once. */
export interface Lease<T> {
  readonly value: T;
  release(): void;
}

/** What all players of a page share, such as a GPU device: made for the first that asks, freed when the last lets go. */
export class Shared<T> {
  private kept: { readonly value: T; users: number } | null = null;

  constructor(
    private readonly make: () => T,
    private readonly free: (value: T) => void,
  ) {}

  /** Throws what `make` throws. */
  take(): Lease<T> {
    const kept = (this.kept ??= { value: this.make(), users: 0 });
    kept.users++;
    let released = false;
    const release = (): void => {
      if (released) return;
      released = true;
      if (--kept.users > 0) return;
      this.forget(kept.value);
      this.free(kept.value);
    };
    return { value: kept.value, release };
  }

  /** It is lost: the next that asks gets another. */
  forget(value: T): void {
    if (this.kept?.value === value) this.kept = null;
  }
}
