// Avatars on a PlayCanvas graphics device with WebGPU.

import type { CameraComponent, GraphicsDevice, Layer } from "playcanvas";
import { AvatarError } from "../errors.js";
import { GpuScene } from "../engine/gpu_scene.js";
import { setView } from "./view.js";

/** What we read of WebgpuGraphicsDevice besides its public names. */
interface Device {
  readonly wgpu: GPUDevice;
  readonly renderTarget: {
    readonly width: number;
    readonly height: number;
    readonly samples: number;
    readonly impl: {
      readonly renderPassDescriptor: GPURenderPassDescriptor;
      readonly colorAttachments: readonly { readonly format: GPUTextureFormat; readonly transient: boolean }[];
      readonly depthAttachment: { readonly format: GPUTextureFormat; readonly hasStencil: boolean; readonly transient: boolean } | null;
    };
  };
  readonly bindGroupFormats: unknown[];
  passEncoder: GPURenderPassEncoder | null;
  insideRenderPass: boolean;
  startRenderPass(pass: Pass): void;
  submit(): void;
  getCommandEncoder(): GPUCommandEncoder;
  setupPassEncoderDefaults(): void;
  setViewport(x: number, y: number, w: number, h: number): void;
  setScissor(x: number, y: number, w: number, h: number): void;
}
interface Pass {
  readonly layerRenderSteps?: readonly { readonly layer: Layer; readonly transparent: boolean }[];
  readonly colorArrayOps: { store: boolean }[];
  readonly depthStencilOps: { storeDepth: boolean; storeStencil: boolean };
}

const METHODS = ["startRenderPass", "submit", "getCommandEncoder", "setupPassEncoderDefaults"] as const;

/** Draws between two layers: ends the pass of the device there, draws over it, and goes on with a pass that keeps all. */
export class WebGpuHost extends GpuScene<CameraComponent> {
  private readonly device: Device;
  private readonly restore: () => void;

  constructor(private readonly graphicsDevice: GraphicsDevice, layer: number, depthAlpha: number | null) {
    const device = graphicsDevice as unknown as Device;
    if (device.wgpu === undefined) throw unknown("a device");
    for (const name of METHODS) {
      if (typeof device[name] !== "function") throw unknown(name);
    }
    super(device.wgpu, depthAlpha);
    this.device = device;
    const start = device.startRenderPass;
    device.startRenderPass = (pass) => {
      if (pass.layerRenderSteps?.some((step) => step.transparent && step.layer.id === layer)) keepContent(pass);
      start.call(device, pass);
    };
    this.restore = () => (device.startRenderPass = start);
  }

  draw(camera: CameraComponent): void {
    const { device, over } = this;
    const { impl, samples } = device.renderTarget;
    const descriptor = impl.renderPassDescriptor;
    const color = (descriptor.colorAttachments as (GPURenderPassColorAttachment | null)[])[0];
    const attachment = impl.colorAttachments[0];
    if (!color || !attachment || device.passEncoder === null) throw unknown("a pass under way");
    if (attachment.transient || impl.depthAttachment?.transient) {
      throw new AvatarError("avatars cannot be drawn into a target with transient attachments", { owner: "PlayCanvas" });
    }
    over.color = color;
    over.format = attachment.format;
    over.samples = Math.max(samples, 1);
    over.depth = descriptor.depthStencilAttachment;
    over.depthFormat = impl.depthAttachment?.format;
    setView(this.view, camera, this.graphicsDevice);
    this.endPass(device.passEncoder);
    this.drawOver();
    this.goOn(descriptor);
  }

  override dispose(): void {
    this.restore();
    super.dispose();
  }

  private endPass(pass: GPURenderPassEncoder): void {
    const { device } = this;
    pass.end();
    device.passEncoder = null;
    device.insideRenderPass = false;
    device.bindGroupFormats.length = 0;
    device.submit();
  }

  private goOn(descriptor: GPURenderPassDescriptor): void {
    const { device } = this;
    const { width, height, impl } = device.renderTarget;
    for (const color of descriptor.colorAttachments as (GPURenderPassColorAttachment | null)[]) {
      if (color !== null) color.loadOp = "load";
    }
    const depth = descriptor.depthStencilAttachment;
    if (depth) depth.depthLoadOp = "load";
    if (depth && impl.depthAttachment?.hasStencil) depth.stencilLoadOp = "load";
    device.passEncoder = device.getCommandEncoder().beginRenderPass(descriptor);
    device.insideRenderPass = true;
    device.setupPassEncoderDefaults();
    device.setViewport(0, 0, width, height);
    device.setScissor(0, 0, width, height);
  }
}

/** A pass that is interrupted must store what it draws. */
function keepContent(pass: Pass): void {
  for (const color of pass.colorArrayOps) color.store = true;
  pass.depthStencilOps.storeDepth = true;
  pass.depthStencilOps.storeStencil = true;
}

function unknown(what: string): AvatarError {
  return new AvatarError(`the WebGPU device has not ${what} where it was in release 2.23; use that one`, { owner: "PlayCanvas" });
}
