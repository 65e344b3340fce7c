// Stages sort and raster of all splats of a scene: one stable sort, instanced quads, one image.

import { PassList, groupsOf, type Bound } from "./passes.js";
import type { Pipelines } from "./pipelines.js";
import { checkBufferSize } from "./device.js";

const STORAGE = 0x80, COPY_DST = 0x8, COPY_SRC = 0x4, VERTEX = 0x20; // GPUBufferUsage
const PAIR = 8, WORD = 4; // bytes of (key, id), of a count
const DIGITS = 16, BITS = 4, PASSES = 8;
const BLOCK = 1024; // pairs a thread group: AVATAR_SORT_BLOCK of sort.hlsli
export const QUAD = 48; // bytes of one drawn instance

/** A run of projected splats in one buffer. */
export interface ProjectedChunk {
  readonly projected: GPUBuffer;
  readonly count: number;
}

/** The order of all splats, and the quads that draw them back to front. */
export class Sorted {
  readonly count: number;
  readonly quads: GPUBuffer;
  readonly pairs: GPUBuffer;
  /** Whether `encode` was called. */
  encoded = false;
  private readonly passes: PassList;
  private readonly buffers: GPUBuffer[];
  private readonly sorting: number; // dispatches before those that gather

  /** Throws AvatarError where all splats together exceed a limit of the GPU. */
  constructor(pipelines: Pipelines, chunks: readonly ProjectedChunk[]) {
    const { device } = pipelines;
    const count = chunks.reduce((sum, chunk) => sum + chunk.count, 0);
    const blocks = Math.max(Math.ceil(count / BLOCK), 1);
    checkBufferSize(device, QUAD * count, `the scene of ${count} splats`);
    const make = (label: string, bytes: number, usage = 0): GPUBuffer =>
      device.createBuffer({ label, size: Math.max(bytes, 16), usage: STORAGE | COPY_SRC | COPY_DST | usage });
    this.count = count;
    this.pairs = make("pairs", PAIR * count);
    this.quads = make("quads", QUAD * count, VERTEX);
    const other = make("other pairs", PAIR * count);
    const counts = make("digits", WORD * DIGITS * blocks);
    this.buffers = [this.pairs, this.quads, other, counts];
    const sort = count > 0 ? [...keys(chunks, this.pairs), ...turns(this.pairs, other, counts, count, blocks)] : [];
    this.sorting = sort.length;
    this.passes = new PassList(pipelines, [...sort, ...gathers(chunks, this.pairs, this.quads, count)], null);
  }

  encode(pass: GPUComputePassEncoder): void {
    this.passes.encode(pass);
    this.encoded = true;
  }

  /** Stage sort alone. */
  encodeSort(pass: GPUComputePassEncoder): void {
    this.passes.encode(pass, 0, this.sorting);
  }

  /** The quads of an order that was written to `pairs`. */
  encodeGather(pass: GPUComputePassEncoder): void {
    this.passes.encode(pass, this.sorting);
  }

  dispose(): void {
    this.passes.dispose();
    for (const buffer of this.buffers) buffer.destroy();
  }
}

function keys(chunks: readonly ProjectedChunk[], pairs: GPUBuffer): Bound[] {
  let first = 0;
  return chunks.map(({ projected, count }) => {
    const constants = { count, first };
    first += count;
    return { entry: "sort_keys", groups: groupsOf(count), buffers: { Projected: projected, Pairs: pairs }, constants };
  });
}

/** Eight turns of a radix sort; an even number ends where it began. */
function turns(pairs: GPUBuffer, other: GPUBuffer, counts: GPUBuffer, count: number, groups: number): Bound[] {
  const made: Bound[] = [];
  for (let turn = 0; turn < PASSES; turn++) {
    const even = turn % 2 === 0;
    const buffers = { Pairs: even ? pairs : other, PairsOut: even ? other : pairs, Counts: counts };
    const constants = { count, groups, shift: BITS * turn, total: DIGITS * groups };
    made.push({ entry: "sort_count", groups, buffers, constants });
    made.push({ entry: "sort_scan", groups: 1, buffers, constants });
    made.push({ entry: "sort_scatter", groups, buffers, constants });
  }
  return made;
}

function gathers(chunks: readonly ProjectedChunk[], pairs: GPUBuffer, quads: GPUBuffer, count: number): Bound[] {
  let first = 0;
  return chunks.map((chunk) => {
    const constants = { count, begin: 0, piece_count: count, first, chunk_count: chunk.count, reverse: 1 };
    first += chunk.count;
    const buffers = { Projected: chunk.projected, Pairs: pairs, Quads: quads };
    return { entry: "raster_gather", groups: groupsOf(count), buffers, constants };
  });
}
