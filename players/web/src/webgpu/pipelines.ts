// Pipelines of the generated kernels, made once a device.

import { LIGHT } from "../light/lazy.js";
import { INTERFACES } from "../made/reflection.js";
import { WGSL } from "../made/wgsl.js";

const COMPUTE = 4; // GPUShaderStage.COMPUTE
const VERTEX_FRAGMENT = 3;

/** A compute kernel with explicit bindings: storage buffers as reflection numbers them, then the uniform block. */
export interface Kernel {
  readonly entry: string;
  readonly pipeline: GPUComputePipeline;
  readonly layout: GPUBindGroupLayout;
}

const OF_DEVICES = new WeakMap<GPUDevice, Pipelines>();

/** The pipelines of a device. */
export function pipelinesOf(device: GPUDevice): Pipelines {
  let pipelines = OF_DEVICES.get(device);
  if (pipelines === undefined) OF_DEVICES.set(device, (pipelines = new Pipelines(device)));
  return pipelines;
}

/** Kernels and shader modules of one device. */
export class Pipelines {
  private readonly kernels = new Map<string, Kernel>();

  constructor(readonly device: GPUDevice) {}

  /** The kernel of a compute entry. */
  kernel(entry: string): Kernel {
    let kernel = this.kernels.get(entry);
    if (kernel === undefined) {
      kernel = this.made(entry);
      this.kernels.set(entry, kernel);
    }
    return kernel;
  }

  /** The module of any entry. */
  module(entry: string): GPUShaderModule {
    return this.device.createShaderModule({ label: entry, code: (WGSL[entry] ?? LIGHT.part?.LIGHT_WGSL[entry]) as string });
  }

  /** The layout of a uniform block that a vertex or fragment entry reads, and of a texture. */
  drawLayout(entry: string, texture: number | null): GPUBindGroupLayout {
    const block = INTERFACES[entry]?.uniforms;
    const entries: GPUBindGroupLayoutEntry[] = [];
    if (block) entries.push({ binding: block.binding, visibility: VERTEX_FRAGMENT, buffer: { type: "uniform" } });
    if (texture !== null) {
      entries.push({ binding: texture, visibility: VERTEX_FRAGMENT, texture: { sampleType: "unfilterable-float" } });
    }
    return this.device.createBindGroupLayout({ label: entry, entries });
  }

  private made(entry: string): Kernel {
    const declared = INTERFACES[entry];
    if (declared === undefined) throw new Error(`no kernel ${entry}`);
    const entries: GPUBindGroupLayoutEntry[] = declared.storage.map((one) => ({
      binding: one.binding,
      visibility: COMPUTE,
      buffer: { type: one.readonly ? "read-only-storage" : "storage" },
    }));
    if (declared.uniforms) {
      entries.push({ binding: declared.uniforms.binding, visibility: COMPUTE, buffer: { type: "uniform" } });
    }
    const layout = this.device.createBindGroupLayout({ label: entry, entries });
    const pipeline = this.device.createComputePipeline({
      label: entry,
      layout: this.device.createPipelineLayout({ bindGroupLayouts: [layout] }),
      compute: { module: this.module(entry), entryPoint: entry },
    });
    return { entry, pipeline, layout };
  }
}
