// The one member of a gzip file (RFC 1952). Browsers inflate it, compare its checksum and size, and take nothing after it.
// Streams of some versions of Node take several members, and bytes after them, so a file that may be like that is inflated
// once more without its last byte.

import { AvatarError } from "../errors.js";

const PIECE = 1 << 18; // bytes that the decompressor is given at once
const FIELDS = 10; // bytes before the optional ones
const TAIL = 8; // bytes of checksum and size
const DEFLATE = 8;
const HAS_CHECKSUM = 2, HAS_EXTRA = 4, HAS_NAME = 8, HAS_COMMENT = 16, RESERVED = 0xe0;

/** Reads what `data` inflates to. */
export function inflated(data: Uint8Array, format: "gzip" | "deflate-raw"): ReadableStreamDefaultReader<Uint8Array> {
  const stream = new DecompressionStream(format) as unknown as ReadableWritablePair<Uint8Array, Uint8Array>;
  let at = 0;
  const pieces = new ReadableStream<Uint8Array>({
    pull(controller) {
      if (at >= data.length) return controller.close();
      controller.enqueue(data.subarray(at, at + PIECE));
      at += PIECE;
    },
  });
  return pieces.pipeThrough(stream).getReader();
}

/** The deflated data of a file that begins as gzip does, if it has one member. Throws AvatarError for a wrong begin. */
export function dataOf(file: Uint8Array): Uint8Array {
  const flags = file[3] ?? 0;
  let at = FIELDS;
  if (flags & HAS_EXTRA) at += 2 + (file[at] ?? 0) + 256 * (file[at + 1] ?? 0);
  for (const flag of [HAS_NAME, HAS_COMMENT]) {
    if (flags & flag) at = file.indexOf(0, at) + 1 || Infinity;
  }
  const end = at;
  if (flags & HAS_CHECKSUM) at += 2;
  if (at + TAIL > file.length) throw new AvatarError("is damaged or cut off (it has no data); load it again");
  if (file[2] !== DEFLATE || flags & RESERVED) throw new AvatarError("is damaged (an unknown kind of gzip); load it again");
  if (at > end && (crc32(file.subarray(0, end)) & 0xffff) !== (file[end] as number) + 256 * (file[end + 1] as number)) {
    throw new AvatarError("is damaged (the checksum of its header differs); load it again");
  }
  return file.subarray(at, file.length - TAIL);
}

function crc32(bytes: Uint8Array): number {
  let rest = -1;
  for (const byte of bytes) {
    rest ^= byte;
    for (let bit = 0; bit < 8; bit++) rest = (rest >>> 1) ^ (rest & 1 ? 0xedb88320 : 0);
  }
  return ~rest;
}

/** Whether the first member of a file that inflated without an error ends before the file; `data` are its `dataOf`. */
export async function endsEarly(file: Uint8Array, data: Uint8Array): Promise<boolean> {
  if (!mayEndEarly(file)) return false;
  try {
    const reader = inflated(data.subarray(0, -1), "deflate-raw"); // Node 18 does not know this format
    while (!(await reader.read()).done);
    return true;
  } catch {
    return false;
  }
}

/** Whether the size of all stands before the end, or a smaller one with a begin of gzip after it. */
function mayEndEarly(file: Uint8Array): boolean {
  const end = file.length - 4;
  const [a, b, c, d] = file.subarray(end) as unknown as [number, number, number, number];
  for (let at = FIELDS; (at = file.indexOf(d, at + 1)) >= 0 && at < file.length - 1;) {
    if (file[at - 1] === c && file[at - 2] === b && file[at - 3] === a) return true;
  }
  for (let at = FIELDS; (at = file.indexOf(0x1f, at + 1)) >= 0 && at < end;) {
    if ((file[at - 1] as number) <= d && file[at + 1] === 0x8b && file[at + 2] === DEFLATE) return true;
  }
  return false;
}
