import { AvatarError } from "../errors.js";
import { type Bits, decode, elementsOf, incidence, type Incidence, type Stored } from "./codecs.js";
import { WORD, wordsOf } from "./content.js";
import type { ArrayText, BufferText, SectionText } from "./document.js";
import type { Inflated } from "./inflate.js";
import { shown } from "./json.js";
import type { Buffer, Elements, Section } from "./model.js";

/** An array that no buffer holds. */
export interface HeldArray {
  readonly values: Float32Array | Uint8Array | Uint16Array | Uint32Array | Int32Array;
  readonly shape: readonly number[];
  readonly type: ArrayText["type"];
}

/** Sections and arrays from the tensors that a document names. Throws AvatarError for what does not fit. */
export class Tensors {
  private readonly decoded = new Map<string, Elements>(); // equal contents are stored once, and decoded once
  private left: number;

  /** All of them take at most `limit` bytes, what is shared counted each time. */
  constructor(
    private readonly inflated: Inflated,
    private readonly limit: number,
  ) {
    this.left = limit;
  }

  /** The buffers of a program, by name. */
  buffers(listed: readonly BufferText[]): Map<string, Buffer> {
    const found = new Map<string, Buffer>();
    for (const { name, bytes, sections } of listed) {
      const where = { field: `buffer ${name}` };
      if (found.has(name)) throw new AvatarError("is named twice", where);
      if ((bytes === undefined) === (sections === undefined)) {
        throw new AvatarError("needs either bytes or sections", where);
      }
      this.take(bytes ?? 0, 8, where.field);
      const made = this.sections(name, sections ?? []);
      const words = made.reduce((sum, section) => sum + wordsOf(section.elements), 0);
      found.set(name, { name, bytes: bytes ?? WORD * words, sections: made });
    }
    return found;
  }

  private sections(buffer: string, listed: readonly SectionText[]): Section[] {
    const found = new Map<string, Elements>();
    let around: Incidence | null = null;
    for (const { name, bits, count, codec, record = 1, tensor } of listed) {
      const where = `buffer ${buffer}, section ${name}`;
      if (found.has(name)) throw new AvatarError("is named twice", { field: where });
      if (codec === "incidence") {
        around ??= this.incidence(listed, found, where);
        this.take(count, bits, where);
        found.set(name, counted(narrowed(name, around, bits), count, where));
      } else {
        found.set(name, this.decode(tensor, codec, bits, count, record, where));
      }
    }
    return [...found].map(([name, elements]) => ({ name, elements }));
  }

  private incidence(listed: readonly SectionText[], found: ReadonlyMap<string, Elements>, where: string): Incidence {
    const corners = found.get("corners");
    const pointer = listed.find((said) => said.name === "vertex_triangle_ptr");
    if (corners === undefined || pointer === undefined || pointer.count < 1) {
      throw new AvatarError("codec incidence needs section corners before it", { field: where });
    }
    this.take(pointer.count, 32, where, 0);
    return incidence(corners, pointer.count - 1, where);
  }

  /** Takes the bytes of a section from what is left, or only asks whether they are there. */
  private take(count: number, bits: Bits, where: string, share: 0 | 1 = 1): void {
    const bytes = (count * bits) / 8;
    if (bytes > this.left) {
      throw new AvatarError(`with it the pack takes more than ${this.limit} bytes`, { field: where });
    }
    this.left -= share * bytes;
  }

  private decode(
    name: string | undefined,
    codec: Stored,
    bits: Bits,
    count: number,
    record: number,
    where: string,
  ): Elements {
    this.take(count, codec === "pointer" ? 32 : bits, where);
    const key = `${codec} ${bits} ${count} ${record} ${name}`;
    const known = this.decoded.get(key);
    if (known !== undefined) return known;
    const entry = name === undefined ? undefined : this.inflated.header.tensors.get(name);
    if (entry === undefined) throw new AvatarError(`tensor ${shown(name)} is missing`, { field: where });
    const data = this.inflated.body.subarray(entry.begin, entry.end);
    const elements = counted(decode(data, codec, bits, count, record, where), count, where);
    this.decoded.set(key, elements);
    return elements;
  }

  /** The arrays of a document, by name. */
  arrays(listed: Readonly<Record<string, ArrayText>>): Map<string, HeldArray> {
    const found = new Map<string, HeldArray>();
    for (const [name, { tensor, type, shape, codec }] of Object.entries(listed)) {
      const where = `array ${name}`;
      const count = shape.reduce((product, length) => product * length, 1);
      const bits = type === "u8" ? 8 : type === "u16" ? 16 : 32;
      found.set(name, { values: typed(this.decode(tensor, codec, bits, count, 1, where), type), shape, type });
    }
    return found;
  }
}

function counted(elements: Elements, count: number, where: string): Elements {
  if (elements.length === count) return elements;
  throw new AvatarError(`has ${elements.length} elements, not ${count}`, { field: where });
}

function typed(elements: Elements, type: string): HeldArray["values"] {
  const { buffer, byteOffset, length } = elements;
  if (type === "f32") return new Float32Array(buffer, byteOffset, length);
  return type === "i32" ? new Int32Array(buffer, byteOffset, length) : elements;
}

function narrowed(name: string, around: Incidence, bits: Bits): Elements {
  const made = name === "vertex_triangle_ptr" ? around.ptr : around.triangle;
  if (bits === 32) return made;
  const elements = elementsOf(bits, made.length);
  elements.set(made);
  return elements;
}
