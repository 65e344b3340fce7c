// Avatars under WebGPURenderer on WebGPU.

import type { Camera } from "three";
import type { WebGPURenderer } from "three/webgpu";
import { GpuScene } from "../engine/gpu_scene.js";
import { contextOf, setView, unknown, type Backend, type RenderContext } from "./context.js";

/** Draws right after the renderer has submitted a pass in which the avatars are visible. */
export class WebGpuHost extends GpuScene<Camera> {
  private readonly cameras = new WeakMap<RenderContext, Camera | null>(); // of passes under way

  /** Throws AvatarError where this release of three.js keeps its device elsewhere. */
  constructor(private readonly renderer: WebGPURenderer, private readonly backend: Backend, depthAlpha: number | null) {
    if (backend.device === undefined || typeof backend.finishRender !== "function") throw unknown("a device and finishRender");
    super(backend.device, depthAlpha);
    const finish = backend.finishRender;
    backend.finishRender = (context) => {
      finish.call(backend, context);
      const camera = this.cameras.get(context);
      if (!camera) return;
      this.cameras.set(context, null);
      this.drawAfter(camera, context);
    };
    this.restore = () => (backend.finishRender = finish);
  }

  draw(camera: Camera): void {
    this.cameras.set(contextOf(this.renderer), camera);
  }

  override dispose(): void {
    this.restore();
    super.dispose();
  }

  private readonly restore: () => void;

  private drawAfter(camera: Camera, context: RenderContext): void {
    const { utils } = this.backend;
    const descriptor = this.backend.get(context).descriptor;
    const color = (descriptor?.colorAttachments as (GPURenderPassColorAttachment | null)[] | undefined)?.[0];
    if (!descriptor || !color) throw unknown("the attachments of a pass");
    const { over } = this;
    over.color = color;
    over.format = utils.getCurrentColorFormat(context);
    over.samples = utils.getSampleCountRenderContext(context);
    over.depth = descriptor.depthStencilAttachment;
    over.depthFormat = utils.getCurrentDepthStencilFormat(context);
    setView(this.view, camera, context, "top");
    this.drawOver();
  }
}
