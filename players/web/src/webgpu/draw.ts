// Draws quads into a float image, and composites that image once.

import { INTERFACES } from "../made/reflection.js";
import type { Background } from "../renderer.js";
import { Block } from "../uniforms.js";
import type { Pipelines } from "./pipelines.js";
import { QUAD } from "./sorted.js";

const UNIFORM = 0x40, COPY_DST = 0x8; // GPUBufferUsage
const ATTACHMENT = 0x10, TEXTURE = 0x4, COPY_SRC = 0x1; // GPUTextureUsage
const ACCUMULATED = 0; // binding of the texture: reflection.json, composite_pixel
const OVER: GPUBlendComponent = { srcFactor: "one", dstFactor: "one-minus-src-alpha", operation: "add" };
/** How quads are read, an instance each. */
export const QUADS: GPUVertexBufferLayout = {
  arrayStride: QUAD,
  stepMode: "instance",
  attributes: [0, 16, 32].map((offset, shaderLocation) => ({ format: "float32x4", offset, shaderLocation })),
};

/** A format of the float image: rgba32float keeps more, where the GPU can blend it. */
export type ImageFormat = "rgba16float" | "rgba32float";

/** The depth of what the host has drawn, of the image's size. */
export interface SceneDepth {
  view: GPUTextureView;
  format: GPUTextureFormat;
  samples: number; // more than 1: the image is multisampled too, for its edges against meshes
  reversed: boolean; // near points have larger values
}

/** Where a frame goes: a view of the host's, its format, what lies in front, whether its content stays. */
export interface Target {
  view: GPUTextureView;
  resolve: GPUTextureView | null; // of a multisampled view
  samples: number;
  format: GPUTextureFormat;
  depth: SceneDepth | null;
  background: Background;
  keep: boolean; // over what the target holds
  linear: boolean; // the target holds linear light
  part: ArrayLike<number> | null; // x, y, width, height in pixels; null: all
}

/** A uniform block in a buffer of its own. */
class GpuBlock extends Block {
  readonly buffer: GPUBuffer;

  constructor(private readonly device: GPUDevice, entry: string, constants: Record<string, number | number[]>) {
    super(entry, constants);
    this.buffer = device.createBuffer({ label: entry, size: this.words.byteLength, usage: UNIFORM | COPY_DST });
  }

  write(): void {
    this.device.queue.writeBuffer(this.buffer, 0, this.words);
  }
}

/** The image that splats accumulate in: premultiplied, display-referred, first row on top. */
export class Accumulator {
  private texture: GPUTexture | null = null;
  private multisampled: GPUTexture | null = null; // resolved into `texture`
  private samples = 1;
  private view: GPUTextureView | null = null;
  private group: GPUBindGroup | null = null; // for compositing
  private readonly raster: GpuBlock;
  private readonly composite: GpuBlock;
  private readonly rasterGroup: GPUBindGroup;
  private readonly drawing = new Map<string, GPURenderPipeline>(); // by depth format
  private readonly compositing = new Map<string, GPURenderPipeline>(); // by target
  private readonly rasterLayout: GPUBindGroupLayout;
  private readonly compositeLayout: GPUBindGroupLayout;
  // Descriptors are changed in place, so that a frame allocates nothing.
  private readonly attachment: GPURenderPassColorAttachment = attachment();
  private readonly depthAttachment: GPURenderPassDepthStencilAttachment = { view: undefined as never, depthReadOnly: true };
  private readonly descriptor: GPURenderPassDescriptor = { label: "splats", colorAttachments: [this.attachment] };
  private readonly target: GPURenderPassColorAttachment = attachment();
  private readonly compositeDescriptor: GPURenderPassDescriptor = { label: "composite", colorAttachments: [this.target] };

  constructor(private readonly pipelines: Pipelines, readonly format: ImageFormat) {
    const { device } = pipelines;
    this.raster = new GpuBlock(device, "raster_vertex", { image_size: [1, 1], flip_y: 1 });
    this.composite = new GpuBlock(device, "composite_pixel", { background: [0, 0, 0, 0], linear_target: 0, flip_rows: 0 });
    this.rasterLayout = pipelines.drawLayout("raster_vertex", null);
    this.compositeLayout = pipelines.drawLayout("composite_pixel", ACCUMULATED);
    const binding = INTERFACES["raster_vertex"]?.uniforms?.binding ?? 0;
    this.rasterGroup = device.createBindGroup({
      layout: this.rasterLayout,
      entries: [{ binding, resource: { buffer: this.raster.buffer } }],
    });
  }

  get size(): readonly [number, number] {
    return [this.texture?.width ?? 0, this.texture?.height ?? 0];
  }

  /** Draws `count` quads into the cleared image of `width` x `height`. */
  draw(encoder: GPUCommandEncoder, quads: GPUBuffer, count: number, width: number, height: number, depth: SceneDepth | null): void {
    this.resize(width, height, depth?.samples ?? 1);
    this.setDepth(depth);
    const pass = encoder.beginRenderPass(this.descriptor);
    if (count > 0) {
      pass.setPipeline(this.drawPipeline(depth));
      pass.setBindGroup(0, this.rasterGroup);
      pass.setVertexBuffer(0, quads);
      pass.draw(4, count);
    }
    pass.end();
  }

  /** Puts the image onto a target, over its background, or over what it holds. */
  onto(encoder: GPUCommandEncoder, target: Target): void {
    const { background, part, resolve } = target;
    for (let i = 0; i < 3; i++) this.composite.set("background", i, background?.[i] ?? 0);
    this.composite.set("background", 3, background === null ? 0 : 1);
    this.composite.set("linear_target", 0, target.linear ? 1 : 0);
    this.composite.write();
    this.target.view = target.view;
    this.target.loadOp = target.keep ? "load" : "clear";
    if (resolve !== null) this.target.resolveTarget = resolve;
    else delete this.target.resolveTarget;
    const pass = encoder.beginRenderPass(this.compositeDescriptor);
    pass.setPipeline(this.compositePipeline(target.format, target.samples));
    pass.setBindGroup(0, this.group as GPUBindGroup);
    if (part !== null) pass.setScissorRect(part[0] as number, part[1] as number, part[2] as number, part[3] as number);
    pass.draw(3);
    pass.end();
  }

  /** The image as it is, for reading back. */
  get image(): GPUTexture | null {
    return this.texture;
  }

  dispose(): void {
    this.texture?.destroy();
    this.multisampled?.destroy();
    this.raster.buffer.destroy();
    this.composite.buffer.destroy();
  }

  private setDepth(depth: SceneDepth | null): void {
    const { descriptor, depthAttachment } = this;
    if (depth === null) {
      if (descriptor.depthStencilAttachment !== undefined) delete descriptor.depthStencilAttachment;
      return;
    }
    depthAttachment.view = depth.view;
    if (depth.format.includes("stencil")) depthAttachment.stencilReadOnly = true;
    else delete depthAttachment.stencilReadOnly;
    descriptor.depthStencilAttachment = depthAttachment;
  }

  private resize(width: number, height: number, samples: number): void {
    if (this.texture?.width === width && this.texture.height === height && this.samples === samples) return;
    const { device } = this.pipelines;
    const format = this.imageFormat(samples);
    this.samples = samples;
    this.texture?.destroy();
    this.multisampled?.destroy();
    this.multisampled = null;
    this.texture = device.createTexture({ label: "accumulated", size: [width, height], format, usage: ATTACHMENT | TEXTURE | COPY_SRC });
    this.view = this.texture.createView();
    this.attachment.view = this.view;
    this.attachment.storeOp = "store";
    delete this.attachment.resolveTarget;
    if (samples > 1) {
      this.multisampled = device.createTexture({ label: "multisampled", size: [width, height], format, sampleCount: samples, usage: ATTACHMENT });
      this.attachment.view = this.multisampled.createView();
      this.attachment.resolveTarget = this.view;
      this.attachment.storeOp = "discard";
    }
    for (const block of [this.raster, this.composite]) {
      block.set("image_size", 0, width);
      block.set("image_size", 1, height);
    }
    this.raster.write();
    const binding = INTERFACES["composite_pixel"]?.uniforms?.binding ?? 0;
    this.group = device.createBindGroup({
      layout: this.compositeLayout,
      entries: [
        { binding: ACCUMULATED, resource: this.view },
        { binding, resource: { buffer: this.composite.buffer } },
      ],
    });
  }

  /** No GPU has to take several samples of 32 bit floats. */
  private imageFormat(samples: number): ImageFormat {
    return samples > 1 ? "rgba16float" : this.format;
  }

  private drawPipeline(depth: SceneDepth | null): GPURenderPipeline {
    const key = depth === null ? "" : `${depth.format} ${depth.samples} ${depth.reversed}`;
    let made = this.drawing.get(key);
    if (made === undefined) {
      const { device } = this.pipelines;
      const described: GPURenderPipelineDescriptor = {
        label: "splats",
        layout: device.createPipelineLayout({ bindGroupLayouts: [this.rasterLayout] }),
        vertex: {
          module: this.pipelines.module("raster_vertex"),
          entryPoint: "raster_vertex",
          buffers: [QUADS],
        },
        fragment: {
          module: this.pipelines.module("raster_pixel"),
          entryPoint: "raster_pixel",
          targets: [{ format: this.imageFormat(depth?.samples ?? 1), blend: { color: OVER, alpha: OVER } }],
        },
        primitive: { topology: "triangle-strip" },
      };
      if (depth !== null) {
        const depthCompare = depth.reversed ? "greater-equal" : "less-equal";
        described.depthStencil = { format: depth.format, depthWriteEnabled: false, depthCompare };
        described.multisample = { count: depth.samples };
      }
      made = device.createRenderPipeline(described);
      this.drawing.set(key, made);
    }
    return made;
  }

  private compositePipeline(format: GPUTextureFormat, samples: number): GPURenderPipeline {
    const key = `${format} ${samples}`;
    let made = this.compositing.get(key);
    if (made === undefined) {
      const { device } = this.pipelines;
      made = device.createRenderPipeline({
        label: "composite",
        layout: device.createPipelineLayout({ bindGroupLayouts: [this.compositeLayout] }),
        vertex: { module: this.pipelines.module("composite_vertex"), entryPoint: "composite_vertex" },
        fragment: {
          module: this.pipelines.module("composite_pixel"),
          entryPoint: "composite_pixel",
          targets: [{ format, blend: { color: OVER, alpha: OVER } }],
        },
        primitive: { topology: "triangle-list" },
        multisample: { count: samples },
      });
      this.compositing.set(key, made);
    }
    return made;
  }
}

function attachment(): GPURenderPassColorAttachment {
  return { view: undefined as never, clearValue: [0, 0, 0, 0], loadOp: "clear", storeOp: "store" };
}
