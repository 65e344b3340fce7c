// The memory of the WebAssembly kernels: blocks of it, views on it.

import { AvatarError } from "../errors.js";

const ALIGNMENT = 16; // bytes: float4
const PAGE = 65536;

interface Block {
  readonly at: number;
  readonly bytes: number;
}

/** First-fit allocation in a WebAssembly.Memory. Addresses are bytes. */
export class Heap {
  private free: Block[] = []; // by address, never adjacent
  private readonly used = new Map<number, number>(); // address -> bytes
  private end: number;
  private seen: ArrayBufferLike;
  private viewU32: Uint32Array;
  private viewF32: Float32Array;
  private viewU8: Uint8Array;

  constructor(
    private readonly memory: WebAssembly.Memory,
    begin: number,
  ) {
    this.end = aligned(begin);
    this.seen = memory.buffer;
    this.viewU32 = new Uint32Array(this.seen);
    this.viewF32 = new Float32Array(this.seen);
    this.viewU8 = new Uint8Array(this.seen);
  }

  get u32(): Uint32Array {
    this.refresh();
    return this.viewU32;
  }

  get f32(): Float32Array {
    this.refresh();
    return this.viewF32;
  }

  get u8(): Uint8Array {
    this.refresh();
    return this.viewU8;
  }

  /** Bytes that are taken now. */
  get bytesUsed(): number {
    let sum = 0;
    for (const bytes of this.used.values()) sum += bytes;
    return sum;
  }

  /** A block of zeros. Throws AvatarError if there is no more memory. */
  allocate(bytes: number, owner?: string): number {
    const size = aligned(Math.max(bytes, ALIGNMENT));
    const index = this.free.findIndex((block) => block.bytes >= size);
    let at: number;
    if (index >= 0) {
      const block = this.free[index] as Block;
      at = block.at;
      if (block.bytes === size) this.free.splice(index, 1);
      else this.free[index] = { at: at + size, bytes: block.bytes - size };
    } else {
      at = this.end;
      this.grow(at + size, owner);
      this.end += size;
    }
    this.used.set(at, size);
    this.u8.fill(0, at, at + size);
    return at;
  }

  release(at: number): void {
    const bytes = this.used.get(at);
    if (bytes === undefined) return;
    this.used.delete(at);
    this.free.push({ at, bytes });
    this.free.sort((a, b) => a.at - b.at);
    const joined: Block[] = [];
    for (const block of this.free) {
      const last = joined[joined.length - 1];
      if (last !== undefined && last.at + last.bytes === block.at) {
        joined[joined.length - 1] = { at: last.at, bytes: last.bytes + block.bytes };
      } else joined.push(block);
    }
    const last = joined[joined.length - 1];
    if (last !== undefined && last.at + last.bytes === this.end) {
      this.end = last.at;
      joined.pop();
    }
    this.free = joined;
  }

  private grow(end: number, owner?: string): void {
    const missing = end - this.memory.buffer.byteLength;
    if (missing <= 0) return;
    try {
      this.memory.grow(Math.ceil(missing / PAGE));
    } catch {
      throw new AvatarError(`the avatars need ${end} bytes; this browser gives WebAssembly less. Use a coarser level of detail.`, {
        owner,
        field: "WebGL2",
      });
    }
  }

  private refresh(): void {
    if (this.memory.buffer === this.seen) return;
    this.seen = this.memory.buffer;
    this.viewU32 = new Uint32Array(this.seen);
    this.viewF32 = new Float32Array(this.seen);
    this.viewU8 = new Uint8Array(this.seen);
  }
}

function aligned(bytes: number): number {
  return Math.ceil(bytes / ALIGNMENT) * ALIGNMENT;
}
