// A list of dispatches with their bind groups and uniforms: encoded again each frame, made once.

import type { FrameLayout, FrameValues } from "../frame.js";
import { INTERFACES } from "../made/reflection.js";
import { Uniforms, type Dispatched } from "../uniforms.js";
import type { Kernel, Pipelines } from "./pipelines.js";

const THREADS = 64;
const UNIFORM = 0x40, COPY_DST = 0x8; // GPUBufferUsage

/** A dispatch with its buffers under the shader's names. */
export interface Bound extends Dispatched {
  readonly groups: number; // thread groups
  readonly buffers: Readonly<Record<string, GPUBuffer>>;
}

/** Thread groups of `rows` threads. */
export function groupsOf(rows: number, threads = THREADS): number {
  return Math.ceil(rows / threads);
}

/** Dispatches that follow each other. WebGPU orders their reads and writes by itself. */
export class PassList {
  readonly uniforms: Uniforms;
  private readonly kernels: Kernel[];
  private readonly groups: GPUBindGroup[];
  private readonly counts: number[];
  private readonly block: GPUBuffer;

  constructor(
    private readonly pipelines: Pipelines,
    bound: readonly Bound[],
    layout: FrameLayout | null,
  ) {
    const { device } = pipelines;
    this.uniforms = new Uniforms(bound, device.limits.minUniformBufferOffsetAlignment, layout);
    this.block = device.createBuffer({
      label: "uniforms",
      size: Math.max(this.uniforms.bytes, 16),
      usage: UNIFORM | COPY_DST,
    });
    this.kernels = bound.map((one) => pipelines.kernel(one.entry));
    this.counts = bound.map((one) => one.groups);
    this.groups = bound.map((one, i) => this.bindGroup(one, i));
    this.write();
  }

  /** New values of the frame; returns whether one has changed. */
  set(frame: FrameValues): boolean {
    const changed = this.uniforms.set(frame);
    if (changed) this.write();
    return changed;
  }

  /** Uniforms.keepLasting, when what was encoded is submitted. */
  keepLasting(): void {
    if (this.uniforms.keepLasting()) this.write();
  }

  /** Encodes dispatches first .. end; all of them by default. */
  encode(pass: GPUComputePassEncoder, first = 0, end = this.kernels.length): void {
    for (let i = first; i < end; i++) {
      pass.setPipeline((this.kernels[i] as Kernel).pipeline);
      pass.setBindGroup(0, this.groups[i] as GPUBindGroup);
      pass.dispatchWorkgroups(this.counts[i] as number);
    }
  }

  /** The dispatches of one stage. */
  encodeStage(pass: GPUComputePassEncoder, stage: string): void {
    this.kernels.forEach(({ entry }, i) => {
      if (INTERFACES[entry]?.stage === stage) this.encode(pass, i, i + 1);
    });
  }

  dispose(): void {
    this.block.destroy();
  }

  private write(): void {
    if (this.uniforms.bytes > 0) this.pipelines.device.queue.writeBuffer(this.block, 0, this.uniforms.words);
  }

  private bindGroup(one: Bound, i: number): GPUBindGroup {
    const declared = INTERFACES[one.entry];
    const entries: GPUBindGroupEntry[] = (declared?.storage ?? []).map((item) => ({
      binding: item.binding,
      resource: { buffer: one.buffers[item.name] as GPUBuffer },
    }));
    if (declared?.uniforms) {
      const offset = this.uniforms.offsets[i] as number;
      const resource = { buffer: this.block, offset, size: declared.uniforms.size };
      entries.push({ binding: declared.uniforms.binding, resource });
    }
    const { layout } = this.kernels[i] as Kernel;
    return this.pipelines.device.createBindGroup({ label: one.entry, layout, entries });
  }
}
