// A list of passes in the memory of the WebAssembly kernels.

import type { FrameLayout } from "../frame.js";
import { INTERFACES } from "../made/reflection.js";
import { Uniforms, type Dispatched } from "../uniforms.js";
import type { Heap } from "./memory.js";

const WORD = 4; // bytes
const ALIGNMENT = 16;

/** Runs rows first .. first + rows of an entry; `params` is the address of its buffers' addresses. */
export type Kernel = (params: number, first: number, rows: number) => void;
/** The functions of kernels.wasm by entry. */
export type Kernels = Readonly<Record<string, Kernel>>;

/** A dispatch with the addresses of its buffers under the shader's names. */
export interface Placed extends Dispatched {
  readonly rows: number;
  readonly buffers: Readonly<Record<string, number>>;
}

/** Dispatches that follow each other. */
export class KernelPasses {
  readonly uniforms: Uniforms;
  private readonly kernels: Kernel[];
  private readonly rows: number[];
  private readonly stages: (string | undefined)[];
  private readonly params: number[];
  private readonly block: number; // address of the uniform blocks
  private readonly table: number; // address of all params

  constructor(
    private readonly heap: Heap,
    kernels: Kernels,
    placed: readonly Placed[],
    layout: FrameLayout | null,
    owner?: string,
  ) {
    this.uniforms = new Uniforms(placed, ALIGNMENT, layout);
    this.block = heap.allocate(this.uniforms.bytes, owner);
    const lengths = placed.map((one) => (INTERFACES[one.entry]?.storage.length ?? 0) + 1);
    this.table = heap.allocate(WORD * lengths.reduce((sum, n) => sum + n, 0), owner);
    this.kernels = placed.map((one) => kernels[one.entry] as Kernel);
    this.stages = placed.map((one) => INTERFACES[one.entry]?.stage);
    this.rows = placed.map((one) => one.rows);
    this.params = [];
    let at = this.table;
    placed.forEach((one, i) => {
      this.params.push(at);
      const words = heap.u32;
      for (const item of INTERFACES[one.entry]?.storage ?? []) {
        words[at / WORD] = one.buffers[item.name] as number;
        at += WORD;
      }
      words[at / WORD] = this.block + (this.uniforms.offsets[i] as number);
      at += WORD;
    });
    this.write();
  }

  /** Copies the uniform blocks into the kernels' memory. */
  write(): void {
    this.heap.u32.set(this.uniforms.words, this.block / WORD);
  }

  run(): void {
    for (let i = 0; i < this.kernels.length; i++) this.runOne(i, this.rows[i] as number);
  }

  /** The dispatches of one stage. */
  runStage(stage: string): void {
    this.stages.forEach((of, i) => {
      if (of === stage) this.runOne(i, this.rows[i] as number);
    });
  }

  /** One dispatch over its first `rows` rows. */
  runOne(index: number, rows: number): void {
    (this.kernels[index] as Kernel)(this.params[index] as number, 0, rows);
  }

  dispose(): void {
    this.heap.release(this.block);
    this.heap.release(this.table);
  }
}
