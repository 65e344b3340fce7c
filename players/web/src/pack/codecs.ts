// How a pack stores the elements of a section: five codecs. All integers are little-endian.
//
// raw        the elements.
// planes     records of `record` elements, byte by byte: first byte 0 of every record, then byte 1, and so on.
// delta      each element minus the one before it, modulo 2^bits; then planes of one element.
// pointer    uint32 [n + 1] that begins at 0 and never falls: the n differences, as narrow as they allow; then planes.
// incidence  nothing: vertex_triangle_ptr and vertex_triangle follow from section `corners` of the same buffer.

import { AvatarError } from "../errors.js";
import type { SectionText } from "./document.js";
import type { Elements } from "./model.js";

/** A codec of something that is stored. */
export type Stored = Exclude<SectionText["codec"], "incidence">;
export type Bits = SectionText["bits"];

/** Room for `count` elements. */
export function elementsOf(bits: Bits, count: number): Elements {
  return bits === 8 ? new Uint8Array(count) : bits === 16 ? new Uint16Array(count) : new Uint32Array(count);
}

/** `count` elements of a tensor's bytes. Throws AvatarError, which names the section `where`, for another length. */
export function decode(
  data: Uint8Array,
  codec: Stored,
  bits: Bits,
  count: number,
  record: number,
  where: string,
): Elements {
  if (codec === "pointer") return pointer(data, count, where);
  const size = (count * bits) / 8;
  if (data.length !== size) {
    throw new AvatarError(`stores ${data.length} bytes; ${count} elements of ${bits} bits take ${size}`, {
      field: where,
    });
  }
  if (codec === "planes" && count % record !== 0) {
    throw new AvatarError(`has ${count} elements, which are no whole records of ${record}`, { field: where });
  }
  const elements = elementsOf(bits, count);
  if (codec === "raw") {
    new Uint8Array(elements.buffer).set(data);
  } else {
    gather(data, elements, codec === "planes" ? record : 1);
  }
  if (codec === "delta") {
    for (let i = 0, sum = 0; i < count; i++) {
      sum = (sum + (elements[i] as number)) | 0;
      elements[i] = sum; // modulo 2^bits
    }
  }
  return elements;
}

/** Puts the planes of `data` together: byte c of record r is data[c * records + r]. */
function gather(data: Uint8Array, into: Elements, record: number): void {
  const size = record * into.BYTES_PER_ELEMENT;
  const records = into.byteLength / size;
  if (size === 1) {
    into.set(data);
  } else if (record === 1 && into instanceof Uint16Array) {
    for (let r = 0; r < records; r++) into[r] = (data[r] as number) | ((data[records + r] as number) << 8);
  } else {
    const bytes = new Uint8Array(into.buffer);
    for (let r = 0, to = 0; r < records; r++) {
      for (let c = 0, from = r; c < size; c++, from += records) bytes[to++] = data[from] as number;
    }
  }
}

function pointer(data: Uint8Array, count: number, where: string): Uint32Array {
  const rows = count - 1;
  const size = rows > 0 ? Math.floor(data.length / rows) : 1;
  if (rows < 0 || (size !== 1 && size !== 2 && size !== 4) || size * rows !== data.length) {
    throw new AvatarError(`stores ${data.length} bytes for ${rows} counts`, { field: where });
  }
  const counts = elementsOf((8 * size) as Bits, rows);
  gather(data, counts, 1);
  const ends = new Uint32Array(count);
  let end = 0;
  for (let row = 0; row < rows; row++) {
    end += counts[row] as number;
    ends[row + 1] = end;
  }
  if (end >= 2 ** 32) throw new AvatarError("counts more than 2^32 entries", { field: where });
  return ends;
}

/** Triangles around each vertex: those of vertex v, rising, are triangle[ptr[v]] .. triangle[ptr[v + 1] - 1]. */
export interface Incidence {
  readonly ptr: Uint32Array; // [V + 1]
  readonly triangle: Uint32Array; // [3 F]
}

/** The triangles around each vertex of `corners` [3, F]. Throws AvatarError for a corner that is no vertex. */
export function incidence(corners: Elements, vertices: number, where: string): Incidence {
  const triangles = corners.length / 3;
  const ptr = new Uint32Array(Math.max(vertices, 0) + 1);
  for (let i = 0; i < corners.length; i++) {
    const vertex = corners[i] as number;
    if (vertex >= vertices || !Number.isInteger(triangles)) {
      throw new AvatarError(`has corners that are none of the ${vertices} vertices`, { field: where });
    }
    ptr[vertex + 1] = (ptr[vertex + 1] as number) + 1;
  }
  for (let v = 0; v < vertices; v++) ptr[v + 1] = (ptr[v + 1] as number) + (ptr[v] as number);
  const next = ptr.slice();
  const triangle = new Uint32Array(corners.length);
  for (let t = 0; t < triangles; t++) {
    for (let corner = 0; corner < 3; corner++) {
      const vertex = corners[corner * triangles + t] as number;
      const at = next[vertex] as number;
      triangle[at] = t;
      next[vertex] = at + 1;
    }
  }
  return { ptr, triangle };
}
