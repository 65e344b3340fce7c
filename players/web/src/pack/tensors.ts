import { AvatarError } from "../errors.js";
import { type Bits, CODECS, type Codec, decode, elementsOf, incidence, type Incidence } from "./codecs.js";
import { WORD, wordsOf } from "./content.js";
import type { Entry } from "./header.js";
import type { Inflated } from "./inflate.js";
import { type Json, U32_MAX } from "./json.js";
import type { Buffer, Elements, Section } from "./model.js";

const MOST_BUFFERS = 4096;
const MOST_SECTIONS = 128;
const MOST_RECORD = 1024;
const MOST_NAME = 96;
const MOST_BUFFER = 2 ** 31 - 1; // bytes
const MOST_VERTICES = 65535 * 64; // of a mesh whose incidence is made; no pass takes more
const MOST_DECODED = 2 ** 31; // bytes of all sections and arrays

/** An array that no buffer holds. */
export interface HeldArray {
  readonly values: Float32Array | Uint8Array | Uint16Array | Uint32Array | Int32Array;
  readonly shape: readonly number[];
}

/** Sections and arrays from the tensors that a document names. Throws AvatarError for what does not fit. */
export class Tensors {
  private readonly decoded = new Map<string, Elements>(); // equal contents are stored once, and decoded once
  private left = MOST_DECODED;

  constructor(private readonly inflated: Inflated) {}

  /** The buffers of a program, by name. */
  buffers(listed: Json): Map<string, Buffer> {
    const found = new Map<string, Buffer>();
    for (const said of listed.list(0, MOST_BUFFERS)) {
      const name = said.at("name").name(MOST_NAME);
      if (found.has(name)) throw new AvatarError("is named twice", { field: `buffer ${name}` });
      found.set(name, this.buffer(name, said));
    }
    return found;
  }

  private buffer(name: string, said: Json): Buffer {
    const bytes = said.optional("bytes", (one) => one.whole(0, MOST_BUFFER));
    if ((bytes !== null) === (said.at("sections").value !== undefined)) {
      throw new AvatarError("needs either bytes or sections", { field: `buffer ${name}` });
    }
    if (bytes !== null) return { name, bytes, sections: [] };
    const sections = this.sections(name, said.at("sections").list(1, MOST_SECTIONS));
    const words = sections.reduce((sum, section) => sum + wordsOf(section.elements), 0);
    return { name, bytes: WORD * words, sections };
  }

  private sections(buffer: string, listed: readonly Json[]): Section[] {
    const found = new Map<string, Elements>();
    let around: Incidence | null = null;
    for (const said of listed) {
      const name = said.at("name").name(MOST_NAME);
      const where = `buffer ${buffer}, section ${name}`;
      if (found.has(name)) throw new AvatarError("is named twice", { field: where });
      const bits = bitsOf(said.at("bits"));
      const count = said.at("count").whole();
      const codec = said.at("codec").one(CODECS);
      if (codec === "incidence") {
        around ??= incidenceOf(listed, found, where);
        found.set(name, this.counted(narrowed(name, around, bits), count, where));
      } else {
        const record = said.optional("record", (one) => one.whole(1, MOST_RECORD)) ?? 1;
        found.set(name, this.decode(said.at("tensor"), codec, bits, count, record, where));
      }
    }
    return [...found].map(([name, elements]) => ({ name, elements }));
  }

  private counted(elements: Elements, count: number, where: string): Elements {
    if (elements.length !== count) {
      throw new AvatarError(`has ${elements.length} elements, not ${count}`, { field: where });
    }
    return elements;
  }

  private decode(tensor: Json, codec: Codec, bits: Bits, count: number, record: number, where: string): Elements {
    const name = tensor.text();
    const key = `${codec} ${bits} ${count} ${record} ${name}`;
    const known = this.decoded.get(key);
    if (known !== undefined) return known;
    const entry: Entry | undefined = this.inflated.header.tensors.get(name);
    if (entry === undefined) throw new AvatarError(`tensor '${name.slice(0, MOST_NAME)}' is missing`, { field: where });
    this.left -= (count * bits) / 8;
    if (this.left < 0) {
      throw new AvatarError(`with it the pack takes more than ${MOST_DECODED} bytes`, { field: where });
    }
    const data = this.inflated.body.subarray(entry.begin, entry.end);
    const elements = decode(data, codec, bits, count, record, where);
    this.decoded.set(key, elements);
    return this.counted(elements, count, where);
  }

  /** The arrays of a document, by name. */
  arrays(listed: Json): Map<string, HeldArray> {
    const found = new Map<string, HeldArray>();
    for (const [name, said] of listed.entries()) {
      const type = said.at("type").one(["f32", "u8", "u16", "u32", "i32"]);
      const shape = said.at("shape").list(0, 4).map((length) => length.whole());
      const count = shape.reduce((product, length) => product * length, 1);
      const codec = said.at("codec").one(["raw", "planes"]);
      const bits = type === "u8" ? 8 : type === "u16" ? 16 : 32;
      if (count > U32_MAX) {
        throw new AvatarError(`has ${count} numbers; ${U32_MAX} are the most`, { field: `array ${name}` });
      }
      const elements = this.decode(said.at("tensor"), codec, bits, count, 1, `array ${name}`);
      found.set(name, { values: typed(elements, type), shape });
    }
    return found;
  }
}

function typed(elements: Elements, type: string): HeldArray["values"] {
  const { buffer, byteOffset, length } = elements;
  if (type === "f32") return new Float32Array(buffer, byteOffset, length);
  return type === "i32" ? new Int32Array(buffer, byteOffset, length) : elements;
}

function bitsOf(said: Json): Bits {
  if (said.value !== 8 && said.value !== 16 && said.value !== 32) throw said.error("8, 16 or 32 is needed");
  return said.value;
}

function incidenceOf(listed: readonly Json[], found: ReadonlyMap<string, Elements>, where: string): Incidence {
  const corners = found.get("corners");
  const pointer = listed.find((said) => said.at("name").value === "vertex_triangle_ptr");
  if (corners === undefined || pointer === undefined) {
    throw new AvatarError("codec incidence needs section corners before it", { field: where });
  }
  return incidence(corners, pointer.at("count").whole(0, MOST_VERTICES + 1) - 1, where);
}

function narrowed(name: string, around: Incidence, bits: Bits): Elements {
  const made = name === "vertex_triangle_ptr" ? around.ptr : around.triangle;
  if (bits === 32) return made;
  const elements = elementsOf(bits, made.length);
  elements.set(made);
  return elements;
}
