// Writes the depth of splats into the depth attachment of a host.

import { DEPTH_WGSL } from "../made/depth.js";
import { INTERFACES } from "../made/reflection.js";
import { QUADS, type SceneDepth } from "../webgpu/draw.js";
import type { Pipelines } from "../webgpu/pipelines.js";
import type { Sorted } from "../webgpu/sorted.js";

const VERTEX = "raster_vertex";
const ENTRY = "raster_depth_pixel"; // binds the block of VERTEX
const UNIFORM = 0x40, COPY_DST = 0x8; // GPUBufferUsage
const DOWNWARDS = 1; // row 0 of the target is at the top of the clip space

/** Draws quads once more, without colour. */
export class GpuDepthPass {
  private readonly constants = new Float32Array(4); // RasterDepthConstants: width, height, flip_y, depth_alpha
  private readonly buffer: GPUBuffer;
  private readonly layout: GPUBindGroupLayout;
  private readonly group: GPUBindGroup;
  private readonly made = new Map<string, GPURenderPipeline>(); // by depth format
  private readonly attachment: GPURenderPassDepthStencilAttachment = { view: undefined as never, depthLoadOp: "load", depthStoreOp: "store" };
  private readonly descriptor: GPURenderPassDescriptor = { label: "depth", colorAttachments: [], depthStencilAttachment: this.attachment };
  private readonly commands: GPUCommandBuffer[] = [];

  constructor(private readonly pipelines: Pipelines, alpha: number) {
    const { device } = pipelines;
    this.constants[2] = DOWNWARDS;
    this.constants[3] = alpha;
    this.buffer = device.createBuffer({ label: ENTRY, size: this.constants.byteLength, usage: UNIFORM | COPY_DST });
    this.layout = pipelines.drawLayout(VERTEX, null);
    const binding = INTERFACES[VERTEX]?.uniforms?.binding ?? 0;
    this.group = device.createBindGroup({ layout: this.layout, entries: [{ binding, resource: { buffer: this.buffer } }] });
  }

  /** Submits the quads of a picture of `width` x `height`; `part`: where, as in a Target. */
  draw({ quads, count }: Sorted, width: number, height: number, depth: SceneDepth, part: ArrayLike<number> | null): void {
    const { constants, attachment } = this;
    const { device } = this.pipelines;
    constants[0] = width;
    constants[1] = height;
    device.queue.writeBuffer(this.buffer, 0, constants);
    attachment.view = depth.view;
    if (depth.format.includes("stencil")) {
      attachment.stencilLoadOp = "load";
      attachment.stencilStoreOp = "store";
    } else {
      delete attachment.stencilLoadOp;
      delete attachment.stencilStoreOp;
    }
    const encoder = device.createCommandEncoder();
    const pass = encoder.beginRenderPass(this.descriptor);
    pass.setPipeline(this.pipeline(depth));
    pass.setBindGroup(0, this.group);
    pass.setVertexBuffer(0, quads);
    if (part !== null) pass.setScissorRect(part[0] as number, part[1] as number, part[2] as number, part[3] as number);
    pass.draw(4, count);
    pass.end();
    this.commands[0] = encoder.finish();
    device.queue.submit(this.commands);
  }

  dispose(): void {
    this.buffer.destroy();
  }

  private pipeline({ format, samples, reversed }: SceneDepth): GPURenderPipeline {
    const key = `${format} ${samples} ${reversed}`;
    let made = this.made.get(key);
    if (made === undefined) {
      const { device } = this.pipelines;
      made = device.createRenderPipeline({
        label: "depth",
        layout: device.createPipelineLayout({ bindGroupLayouts: [this.layout] }),
        vertex: { module: this.pipelines.module(VERTEX), entryPoint: VERTEX, buffers: [QUADS] },
        fragment: { module: device.createShaderModule({ label: ENTRY, code: DEPTH_WGSL }), entryPoint: ENTRY, targets: [] },
        primitive: { topology: "triangle-strip" },
        depthStencil: { format, depthWriteEnabled: true, depthCompare: reversed ? "greater-equal" : "less-equal" },
        multisample: { count: samples },
      });
      this.made.set(key, made);
    }
    return made;
  }
}
