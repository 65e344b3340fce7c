import { floatsOf, offsetsOf, WORD, widthOf } from "./content.js";
import type { Buffer, Section } from "./model.js";

export const MOST_FLOAT32 = 3.4028234663852886e38;

/** What a pointer section says of its rows. */
export interface Rows {
  readonly rises: boolean; // it begins with 0 and never falls
  readonly last: number; // its last element
  readonly longest: number; // entries of the longest row
}

/** A static buffer: where its sections begin, and what is found in them. Each is searched once. */
export class Packed {
  readonly offsets: ReadonlyMap<string, number>; // section -> its first word
  readonly words: number;
  private readonly sections = new Map<string, Section>();
  private readonly found = new Map<string, number | boolean>();
  private readonly walked = new Map<string, Rows>();

  constructor(buffer: Buffer) {
    this.offsets = offsetsOf(buffer);
    this.words = buffer.bytes / WORD;
    for (const section of buffer.sections) this.sections.set(section.name, section);
  }

  /** The section of that name. */
  section(name: string): Section | undefined {
    return this.sections.get(name);
  }

  /** The largest element; -1 of none. */
  largest(section: Section): number {
    const key = `largest ${section.name}`;
    const known = this.found.get(key);
    if (typeof known === "number") return known;
    const { elements } = section;
    let most = -1;
    for (let i = 0; i < elements.length; i++) most = Math.max(most, elements[i] as number);
    this.found.set(key, most);
    return most;
  }

  /** Whether all elements, float32 by their bits, are finite and no larger than `most`. */
  finite(section: Section, most = MOST_FLOAT32): boolean {
    const key = `finite ${most} ${section.name}`;
    const known = this.found.get(key);
    if (typeof known === "boolean") return known;
    const within = widthOf(section) === 32 && allWithin(floatsOf(section), most);
    this.found.set(key, within);
    return within;
  }

  /** The rows of a pointer section. */
  rows(section: Section): Rows {
    const known = this.walked.get(section.name);
    if (known !== undefined) return known;
    const rows = walk(section);
    this.walked.set(section.name, rows);
    return rows;
  }
}

function allWithin(values: Float32Array, most: number): boolean {
  for (let i = 0; i < values.length; i++) {
    if (!(Math.abs(values[i] as number) <= most)) {
      return false; // NaN compares false
    }
  }
  return true;
}

function walk({ elements }: Section): Rows {
  if (elements.length === 0) return { rises: false, last: 0, longest: 0 };
  const last = elements[elements.length - 1] as number;
  let rises = elements[0] === 0;
  let longest = 0;
  for (let row = 1; row < elements.length; row++) {
    const entries = (elements[row] as number) - (elements[row - 1] as number);
    rises &&= entries >= 0;
    longest = Math.max(longest, entries);
  }
  return { rises, last, longest };
}
