// Avatars on the WebGPU device of a host.

import type { Avatar } from "../avatar.js";
import { Instance } from "../instance.js";
import type { SceneDepth, Target } from "../webgpu/draw.js";
import { WebGpuRenderer } from "../webgpu/renderer.js";
import { GpuDepthPass } from "./gpu_depth_pass.js";
import type { AvatarHost } from "./host.js";
import { EngineView } from "./view.js";

const LATER = undefined as unknown as GPUTextureView; // of each picture

/** What a host has drawn into: its attachments, with what their pipelines must know. */
export interface Attachments {
  color: GPURenderPassColorAttachment | null;
  format: GPUTextureFormat;
  samples: number;
  depth: GPURenderPassDepthStencilAttachment | null | undefined;
  depthFormat: GPUTextureFormat | null | undefined;
}

/**
 * Draws avatars over what a host has drawn, against its depth. The host's pass must be ended and submitted, and its
 * depth and all its samples stored.
 */
export abstract class GpuScene<Seen> implements AvatarHost<Seen> {
  /** To be set for each picture. */
  protected readonly over: Attachments = { color: null, format: "rgba8unorm", samples: 1, depth: null, depthFormat: null };
  /** To be set for each picture. */
  protected readonly view = new EngineView();
  private readonly avatars: WebGpuRenderer;
  private readonly depthPass: GpuDepthPass | null;
  private readonly depth: SceneDepth = { view: LATER, format: "depth24plus", samples: 1, reversed: false };
  private readonly target: Target = {
    view: LATER, resolve: null, samples: 1, format: "rgba8unorm", depth: null, background: null, keep: true, linear: false, part: null,
  };

  /** `depthAlpha`: as the option; null: no depth is written. */
  constructor(device: GPUDevice, depthAlpha: number | null) {
    this.avatars = new WebGpuRenderer(device, null);
    this.depthPass = depthAlpha === null ? null : new GpuDepthPass(this.avatars.pipelines, depthAlpha);
  }

  get lost(): Promise<string> {
    return this.avatars.lost;
  }

  add(avatar: Avatar, level: number): Instance {
    const instance = new Instance(avatar, this.avatars, level);
    this.avatars.add(instance);
    return instance;
  }

  abstract draw(seen: Seen): void;

  finished(): Promise<void> {
    return this.avatars.finished();
  }

  /** Submits one picture of `view` over what `over` names. */
  protected drawOver(): void {
    const { target, depth, over, view } = this;
    const color = over.color as GPURenderPassColorAttachment;
    target.view = color.view as GPUTextureView;
    target.resolve = (color.resolveTarget as GPUTextureView | undefined) ?? null;
    target.samples = depth.samples = over.samples;
    target.format = over.format;
    target.linear = view.linear;
    target.part = view.partial ? view.viewport : null;
    target.depth = null;
    if (over.depth && over.depthFormat) {
      depth.view = over.depth.view as GPUTextureView;
      depth.format = over.depthFormat;
      depth.reversed = view.reversed;
      target.depth = depth;
    }
    this.avatars.frameInto(view.camera, target);
    const { sorted } = this.avatars;
    if (this.depthPass === null || target.depth === null || sorted === null) return;
    this.depthPass.draw(sorted, view.camera.width, view.camera.height, depth, target.part);
  }

  dispose(): void {
    this.avatars.dispose();
    this.depthPass?.dispose();
  }
}
