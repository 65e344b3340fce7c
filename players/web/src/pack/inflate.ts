import { AvatarError } from "../errors.js";
import { type Entry, type Header, readHeader } from "./header.js";
import { dataOf, endsEarly, inflated } from "./member.js";

const HEADER_LIMIT = 16 * 2 ** 20; // bytes of JSON
const HEADER_FREE = 65536; // bytes of it that any file may have
const HEADER_RATIO = 16; // and more for each byte of the file
const BODY_LIMIT = 2 ** 30; // bytes, inflated
const DECODED_LIMIT = 2 ** 31; // bytes of all sections and arrays
const MOST_RATIO = 400; // inflated bytes a byte of the file; gzip reaches 1032 on zeros alone
const LENGTH = 8; // bytes before the header

/** A pack, inflated: its header, and the bytes of its tensors. */
export interface Inflated {
  readonly header: Header;
  readonly body: Uint8Array;
}

/** The most bytes that may be made of a file of `bytes` bytes. */
export function mostOf(bytes: number): number {
  return Math.min(BODY_LIMIT, MOST_RATIO * bytes);
}

/** The most bytes that sections and arrays of a file of `bytes` bytes may decode to. */
export function mostDecodedOf(bytes: number): number {
  return Math.min(DECODED_LIMIT, MOST_RATIO * bytes);
}

/** Inflates a pack, never more than its header says and the limits allow. Throws AvatarError. */
export async function inflate(file: Uint8Array): Promise<Inflated> {
  checkBegin(file);
  const data = dataOf(file);
  const stream = new Inflating(file);
  try {
    const length = new DataView((await stream.take(LENGTH)).buffer).getBigUint64(0, true);
    const most = Math.min(HEADER_LIMIT, HEADER_FREE + HEADER_RATIO * file.length);
    if (length > most) throw new AvatarError(`claims a header of ${length} bytes; up to ${most} are read`);
    const header = readHeader(await stream.take(Number(length)));
    const total = endOf(header.tensors);
    if (total > mostOf(file.length)) {
      throw new AvatarError(
        `claims ${total} bytes in a file of ${file.length}; at most ${MOST_RATIO} times its size and ` +
          `${BODY_LIMIT} are inflated`,
      );
    }
    const body = await stream.take(total);
    await stream.end();
    if (await endsEarly(file, data)) throw new AvatarError("is no gzip file of one member: other bytes follow");
    return { header, body };
  } finally {
    stream.close();
  }
}

/** Throws AvatarError unless a file begins as gzip does. */
function checkBegin(file: Uint8Array): void {
  if (file[0] === 0x1f && file[1] === 0x8b) return;
  if (file.length > LENGTH && file[LENGTH] === 0x7b && file[7] === 0) {
    throw new AvatarError("was inflated on its way: the server must send packs as they are, without Content-Encoding");
  }
  throw new AvatarError("is not a pack: it does not begin as a gzip file");
}

function endOf(tensors: ReadonlyMap<string, Entry>): number {
  let end = 0;
  for (const entry of tensors.values()) end = Math.max(end, entry.end);
  return end;
}

/** Inflates as many bytes as are asked for. */
class Inflating {
  private readonly reader: ReadableStreamDefaultReader<Uint8Array>;
  private rest: Uint8Array = new Uint8Array(0);
  private made = 0;

  constructor(private readonly file: Uint8Array) {
    this.reader = inflated(file, "gzip");
  }

  /** The next `size` bytes. */
  async take(size: number): Promise<Uint8Array> {
    const taken = new Uint8Array(size);
    let at = 0;
    while (at < size) {
      if (this.rest.length === 0) this.rest = await this.next(size - at);
      const part = this.rest.subarray(0, size - at);
      taken.set(part, at);
      at += part.length;
      this.rest = this.rest.subarray(part.length);
    }
    this.made += size;
    return taken;
  }

  /** Checks that nothing follows, and the checksum. */
  async end(): Promise<void> {
    let more = this.rest.length > 0;
    while (!more) {
      const step = await this.read();
      if (step === null) break;
      more = step.length > 0;
    }
    const tail = new DataView(this.file.buffer, this.file.byteOffset + this.file.length - 4, 4);
    if (more || tail.getUint32(0, true) !== this.made % 2 ** 32) throw new AvatarError("goes on after its last tensor");
  }

  /** Lets go of the stream, whether it ended or not. */
  close(): void {
    void this.reader.cancel().catch(() => undefined);
  }

  private async next(missing: number): Promise<Uint8Array> {
    const part = await this.read();
    if (part === null) throw new AvatarError(`ends ${missing} bytes too early: it was cut off; load it again`);
    return part;
  }

  private async read(): Promise<Uint8Array | null> {
    try {
      const { done, value } = await this.reader.read();
      return done ? null : value;
    } catch (error) {
      const why = error instanceof Error ? (error.cause instanceof Error ? error.cause.message : error.message) : "";
      throw new AvatarError(`is damaged or cut off (${why || "gzip"}); load it again`);
    }
  }
}
