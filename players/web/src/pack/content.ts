import type { Buffer, Elements, Section } from "./model.js";

export const WORD = 4; // bytes

/** Bits of an element of a section. */
export function widthOf(section: Section): 8 | 16 | 32 {
  return (8 * section.elements.BYTES_PER_ELEMENT) as 8 | 16 | 32;
}

/** 32-bit words that elements take. */
export function wordsOf(elements: Elements): number {
  return Math.ceil(elements.byteLength / WORD);
}

/** Section name -> its first word in a buffer. */
export function offsetsOf(buffer: Buffer): Map<string, number> {
  const found = new Map<string, number>();
  let at = 0;
  for (const section of buffer.sections) {
    found.set(section.name, at);
    at += wordsOf(section.elements);
  }
  return found;
}

/** The words that are uploaded for a buffer with sections. Each begins at a word; the rest of its last word is 0. */
export function contentOf(buffer: Buffer): Uint32Array {
  let words = 0;
  for (const section of buffer.sections) words += wordsOf(section.elements);
  const content = new Uint32Array(words);
  const bytes = new Uint8Array(content.buffer);
  let at = 0;
  for (const { elements } of buffer.sections) {
    bytes.set(new Uint8Array(elements.buffer, elements.byteOffset, elements.byteLength), at);
    at += WORD * wordsOf(elements);
  }
  return content;
}

/** The float32 values of a section of 32-bit elements. */
export function floatsOf(section: Section): Float32Array {
  const { buffer, byteOffset, length } = section.elements;
  return new Float32Array(buffer, byteOffset, length);
}
