// The uniform blocks of a list of dispatches in one run of words, and what changes of them from frame to frame.

import { FrameLayout, type FrameValues } from "./frame.js";
import { INTERFACES } from "./made/reflection.js";
import type { Constant } from "./pack/model.js";

const WORD = 4; // bytes

/** One dispatch: an entry and its constants. */
export interface Dispatched {
  readonly entry: string;
  readonly constants: Readonly<Record<string, Constant>>;
}

/** Uniform blocks that follow each other, each at a multiple of `alignment` bytes. */
export class Uniforms {
  /** First byte and size of the block of each dispatch. */
  readonly offsets: readonly number[];
  readonly sizes: readonly number[];
  readonly bytes: number;
  readonly floats: Float32Array;
  readonly words: Uint32Array;
  private readonly copies: Int32Array; // triples: to, from, floats
  private readonly lasting: readonly number[]; // words: sh_terms where no expression changes SH

  constructor(dispatches: readonly Dispatched[], alignment: number, layout: FrameLayout | null) {
    const offsets: number[] = [];
    const sizes: number[] = [];
    let at = 0;
    for (const one of dispatches) {
      const size = INTERFACES[one.entry]?.uniforms?.size ?? 0;
      offsets.push(at);
      sizes.push(size);
      at += Math.ceil(Math.max(size, 1) / alignment) * alignment;
    }
    const content = new ArrayBuffer(at);
    this.floats = new Float32Array(content);
    this.words = new Uint32Array(content);
    const copies: number[] = [];
    dispatches.forEach((one, i) => this.fill(one, (offsets[i] as number) / WORD, layout, copies));
    this.offsets = offsets;
    this.sizes = sizes;
    this.bytes = at;
    this.copies = Int32Array.from(copies);
    this.lasting = dispatches.flatMap(({ entry, constants }, i) => {
      return entry === "blend" && constants["appearance_sh_width"] === 0 ? this.word(i, entry, "sh_terms") : [];
    });
  }

  /** The word of a constant of dispatch `index`. */
  word(index: number, entry: string, name: string): number {
    const member = INTERFACES[entry]?.uniforms?.members.find((one) => one.name === name);
    return ((this.offsets[index] as number) + (member?.offset ?? 0)) / WORD;
  }

  /** Copies what the frame gives; returns whether a value has changed. */
  set(frame: Pick<FrameValues, "floats">): boolean {
    const { copies, floats } = this;
    const from = frame.floats;
    let changed = false;
    for (let i = 0; i < copies.length; i += 3) {
      changed = copied(from, copies[i + 1] as number, floats, copies[i] as number, copies[i + 2] as number) || changed;
    }
    return changed;
  }

  /**
   * Call it when the dispatches have run once: SH that no expression changes stay in their buffer, and blend, whose
   * work they mostly are, reads none of them. Returns whether a value has changed.
   */
  keepLasting(): boolean {
    let changed = false;
    for (let i = 0; i < this.lasting.length; i++) {
      const word = this.lasting[i] as number;
      changed = changed || this.words[word] !== 0;
      this.words[word] = 0;
    }
    return changed;
  }

  private fill(one: Dispatched, first: number, layout: FrameLayout | null, copies: number[]): void {
    for (const member of INTERFACES[one.entry]?.uniforms?.members ?? []) {
      const value = one.constants[member.name];
      const at = first + member.offset / WORD;
      if (typeof value === "string") {
        const place = layout?.place(value);
        if (place !== undefined) copies.push(at, place.first, place.floats);
      } else if (typeof value === "number") {
        if (member.type === "uint") this.words[at] = value;
        else this.floats[at] = value;
      } else if (value !== undefined) {
        this.floats.set(value, at);
      }
    }
  }
}

/** The uniform block of one entry, whose constants are set by name. */
export class Block {
  private readonly uniforms: Uniforms;
  private readonly first = new Map<string, number>(); // words

  constructor(entry: string, constants: Readonly<Record<string, Constant>>) {
    this.uniforms = new Uniforms([{ entry, constants }], 16, null);
    for (const { name } of INTERFACES[entry]?.uniforms?.members ?? []) this.first.set(name, this.uniforms.word(0, entry, name));
  }

  get words(): Uint32Array {
    return this.uniforms.words;
  }

  set(name: string, index: number, value: number): void {
    this.uniforms.floats[(this.first.get(name) as number) + index] = value;
  }
}

/** Copies `count` floats from `first` of `from` to `at` of `to`; returns whether one has changed. Both are float32. */
export function copied(from: Float32Array, first: number, to: Float32Array, at: number, count: number): boolean {
  let changed = false;
  for (let i = 0; i < count; i++) {
    const value = from[first + i] as number;
    if (to[at + i] !== value) changed = true; // NaN is always new
    to[at + i] = value;
  }
  return changed;
}
