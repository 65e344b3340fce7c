// One pass against the access contract of its entry: what a kernel would read and write, checked before it runs.
// This interpreter knows no entry, no system and no rule.

import { AvatarError } from "../errors.js";
import type { Contract, Interface, SectionContract, StorageBuffer, Touched } from "../made/reflection.js";
import { widthOf } from "./content.js";
import { shown, U32_MAX } from "./json.js";
import type { Buffer, Constant, Pass, Section } from "./model.js";
import { MOST_FLOAT32, type Packed } from "./packed.js";

const U32_END = U32_MAX + 1;
const PADDING = "unused"; // the member that fills a row of four
const MOST_SCALE = 1e30; // of a float that codes are multiplied by: the product with any code is finite

/** Entries of the shaders by name: what each binds, and its access contract. */
export type Interfaces = Readonly<Record<string, Interface>>;

/** A section of Pose: its first float, and how many items it has. */
export interface PoseSection {
  readonly first: number;
  readonly items: number;
}

/** What passes refer to: buffers, sections found in them, sections of Pose. */
export interface Held {
  readonly buffers: ReadonlyMap<string, Buffer>;
  readonly packed: ReadonlyMap<string, Packed>;
  readonly pose: ReadonlyMap<string, PoseSection>;
}

/** A pass, the contract of its entry, and the buffers that it binds. */
export class Access {
  readonly contract: Contract;
  readonly stage: string;
  readonly storage = new Map<string, StorageBuffer>();
  readonly types = new Map<string, string>(); // constant -> "uint", "float", "float4"
  readonly packedNames = new Set<string>(); // the shader's names of buffers with sections
  private readonly place: string;

  /** Throws AvatarError unless the entry is known and the pass binds and sets exactly what it declares. */
  constructor(
    place: string,
    readonly one: Pass,
    private readonly held: Held,
    interfaces: Interfaces,
  ) {
    this.place = `${place} (${one.entry.slice(0, 40)})`;
    const row = Object.hasOwn(interfaces, one.entry) ? interfaces[one.entry] : undefined;
    if (row === undefined || row.access === null) {
      throw new AvatarError("is no entry that a program may use; a newer version may know it", { field: this.place });
    }
    this.contract = row.access;
    this.stage = row.stage;
    row.storage.forEach((item) => this.storage.set(item.name, item));
    for (const member of row.uniforms?.members ?? []) {
      if (member.name !== PADDING) this.types.set(member.name, member.type);
    }
    for (const section of Object.values(this.contract.sections ?? {})) this.packedNames.add(section.buffer);
    this.checkNames("buffers", this.storage, one.buffers);
    this.checkNames("constants", this.types, one.constants);
    this.checkBuffers();
  }

  /** The error for a constant, section or buffer of this pass. */
  error(what: string, message: string): AvatarError {
    return new AvatarError(message, { field: `${this.place}, ${what}` });
  }

  /** A constant that is a whole number. */
  count(name: string): number {
    return this.one.constants[name] as number;
  }

  /** Types and ranges of the constants. Throws AvatarError. Names of the frame are not looked at. */
  checkConstants(): void {
    for (const [name, value] of Object.entries(this.one.constants)) this.checkType(name, value);
    const { values, most, rows, fits, pose } = this.contract;
    for (const [name, allowed] of Object.entries(values ?? {})) {
      if (!allowed.includes(this.count(name))) {
        throw this.error(name, `${this.count(name)} is not known; known are ${allowed.join(", ")}`);
      }
    }
    for (const [name, limit] of Object.entries(most ?? {})) {
      if (this.count(name) < 1 || this.count(name) > limit) {
        throw this.error(name, `is ${this.count(name)}; 1 to ${limit} are taken`);
      }
    }
    if (!isU32(this.one.rows) || this.one.rows !== this.count(rows)) {
      throw this.error("rows", `are ${shown(this.one.rows)}; constant ${rows} is ${this.count(rows)}`);
    }
    for (const [total, limit] of fits ?? []) {
      if (this.number(total) > this.number(limit)) {
        throw this.error(total, `is ${this.number(total)}; ${limit} is ${this.number(limit)}`);
      }
    }
    for (const [name, section] of Object.entries(pose ?? {})) {
      const first = this.poseSection(section).first;
      if (this.count(name) !== first) throw this.error(name, `is ${this.count(name)}; ${section} begins at ${first}`);
    }
  }

  /** The value of an expression of the contract. */
  number(expression: string): number {
    let sum = 0;
    for (const product of parsed(expression)) sum += product.reduce((value, factor) => value * this.factor(factor), 1);
    return sum;
  }

  /** The shader's name of a buffer without sections -> elements that the pass touches. */
  touched(): Map<string, number> {
    const found = new Map<string, number>();
    for (const [buffer, rows] of Object.entries(this.contract.elements ?? {})) {
      const sizes = rows.filter((row) => this.applies(row)).map((row) => this.number(row.elements));
      found.set(buffer, Math.max(0, ...sizes));
    }
    return found;
  }

  /** Throws AvatarError for a section that the kernel would leave. Returns the entries of all pointers together. */
  checkSections(): number {
    let entries = 0;
    for (const [name, expected] of Object.entries(this.contract.sections ?? {})) {
      if (this.applies(expected)) {
        this.checkSection(name, expected);
        entries += expected.kind === "pointer" ? this.number(`#${name}`) : 0;
      }
    }
    return entries;
  }

  private checkNames(
    what: string,
    wanted: ReadonlyMap<string, unknown>,
    given: Readonly<Record<string, unknown>>,
  ): void {
    const missing = [...wanted.keys()].filter((name) => !Object.hasOwn(given, name)).sort();
    const extra = Object.keys(given).filter((name) => !wanted.has(name)).sort();
    if (missing.length > 0) throw this.error(what, `${missing[0]} is missing`);
    if (extra.length > 0) throw this.error(what, `'${(extra[0] as string).slice(0, 80)}' is not known to this entry`);
  }

  private checkBuffers(): void {
    for (const [name, bound] of Object.entries(this.one.buffers)) {
      const buffer = this.held.buffers.get(bound);
      if (buffer === undefined) throw this.error(name, `'${bound.slice(0, 80)}' is no buffer of the program`);
      if (buffer.sections.length > 0 !== this.packedNames.has(name)) {
        const need = this.packedNames.has(name) ? "a buffer with sections" : "a buffer without sections";
        throw this.error(name, `'${bound}' does not fit; ${need} is needed`);
      }
    }
  }

  private checkType(name: string, value: Constant): void {
    const kind = this.types.get(name) as string;
    if (kind === "uint") {
      if (!isU32(value)) throw this.error(name, `is ${shown(value)}; a whole number of 32 bits is needed`);
    } else if (kind === "float") {
      if (!isFloat32(value)) throw this.error(name, `is ${shown(value)}; a finite float32 is needed`);
    } else if (typeof value !== "string") {
      const floats = Number(kind.slice("float".length));
      if (typeof value === "number" || value.length !== floats || !value.every(isFloat32)) {
        throw this.error(name, `is ${shown(value)}; ${floats} finite float32 are needed`);
      }
    }
  }

  private factor(factor: string): number {
    if (/^[0-9]+$/.test(factor)) return Number(factor);
    if (!factor.startsWith("#")) return this.count(factor);
    const name = factor.slice(1);
    const { pose, sections } = this.contract;
    if (pose !== undefined && Object.hasOwn(pose, name)) return this.poseSection(pose[name] as string).items;
    const { packed, section } = this.section(name, (sections?.[name] as SectionContract).buffer);
    return packed.rows(section).last;
  }

  private poseSection(name: string): PoseSection {
    return this.held.pose.get(name) as PoseSection;
  }

  private applies(part: Touched | SectionContract): boolean {
    return Object.entries(part.when ?? {}).every(([name, values]) => values.includes(this.count(name)));
  }

  /** The section of that name, which must begin where the constant says. */
  private section(name: string, buffer: string): { packed: Packed; section: Section } {
    const bound = this.one.buffers[buffer] as string;
    const packed = this.held.packed.get(bound) as Packed;
    const section = packed.section(name);
    if (section === undefined) throw this.error(name, `buffer '${bound}' has no section of that name`);
    if (this.count(name) !== packed.offsets.get(name)) {
      throw this.error(name, `is ${this.count(name)}; the section begins at word ${packed.offsets.get(name)}`);
    }
    return { packed, section };
  }

  private checkSection(name: string, expected: SectionContract): void {
    const { packed, section } = this.section(name, expected.buffer);
    const wanted = this.number(expected.elements);
    const width = expected.width === undefined ? 32 : this.count(expected.width);
    const widths = expected.widths ?? [32];
    if (!widths.includes(width)) throw this.error(expected.width ?? name, `is ${width}; known are ${widths.join(", ")}`);
    if (width === 0) {
      if (expected.kind !== "signed" && wanted > 0 && (packed.offsets.get(name) as number) >= packed.words) {
        throw this.error(name, "begins at the end of its buffer; one word is read at width 0");
      }
    } else {
      this.checkLength(name, section, width, wanted);
    }
    this.checkKind(name, expected, packed, section, width);
  }

  private checkLength(name: string, section: Section, width: number, wanted: number): void {
    if (widthOf(section) !== width) {
      throw this.error(name, `has elements of ${widthOf(section)} bits; ${width} are stated`);
    }
    if (section.elements.length !== wanted) {
      throw this.error(name, `has ${section.elements.length} elements; ${wanted} are needed`);
    }
    if (width < 32 && wanted * width >= U32_END) {
      throw this.error(name, `has ${wanted} elements of ${width} bits; their bits exceed a 32-bit index`);
    }
  }

  private checkKind(name: string, expected: SectionContract, packed: Packed, section: Section, width: number): void {
    if (expected.kind === "pointer") {
      const rows = packed.rows(section);
      if (!rows.rises) throw this.error(name, "does not begin with 0, or falls");
      if (rows.longest > (expected.pointer as number)) {
        throw this.error(name, `gives a row ${rows.longest} entries; ${expected.pointer} are the most`);
      }
    } else if (expected.kind === "index") {
      this.checkBelow(name, packed.largest(section), this.number(expected.below as string));
    } else if (width === 32) {
      if (!packed.finite(section)) throw this.error(name, "holds a float that is not finite");
    } else {
      this.checkScale(name, expected, packed, section, width);
    }
  }

  private checkBelow(name: string, largest: number, end: number): void {
    if (largest >= end) throw this.error(name, `holds ${largest}; less than ${end} is needed`);
  }

  private checkScale(name: string, expected: SectionContract, packed: Packed, section: Section, width: number): void {
    const scale = expected.scale as string;
    const floats = this.section(scale, expected.buffer).section;
    const length = floats.elements.length;
    const wanted = expected.floats === undefined ? Math.max(length, 1) : this.number(expected.floats);
    if (widthOf(floats) !== 32 || length !== wanted) {
      throw this.error(scale, `has ${length} elements; ${wanted} of 32 bits are needed`);
    }
    if (!packed.finite(floats, MOST_SCALE)) {
      throw this.error(scale, `holds a float that is not finite or exceeds 1e+30`);
    }
    if (expected.kind === "table") this.checkBelow(name, width > 0 ? packed.largest(section) : 0, length);
  }
}

const PARSED = new Map<string, readonly (readonly string[])[]>();

/** The products of a sum, each its factors. Contracts have few expressions, so each is parsed once. */
function parsed(expression: string): readonly (readonly string[])[] {
  let found = PARSED.get(expression);
  if (found === undefined) {
    found = expression.split("+").map((product) => product.split("*"));
    PARSED.set(expression, found);
  }
  return found;
}

/** Whether a value is a whole number of 32 bits. */
export function isU32(value: unknown): value is number {
  return typeof value === "number" && Number.isInteger(value) && value >= 0 && value < U32_END;
}

function isFloat32(value: unknown): value is number {
  return typeof value === "number" && Math.abs(value) <= MOST_FLOAT32;
}
