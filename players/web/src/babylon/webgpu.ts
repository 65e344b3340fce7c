// Avatars in a Babylon.js engine on WebGPU.

import type { Scene } from "@babylonjs/core/scene.js";
import { AvatarError } from "../errors.js";
import { GpuScene } from "../engine/gpu_scene.js";
import { setView } from "./view.js";

/** What we read of WebGPUEngine besides its public names. */
interface Internals {
  readonly _device: GPUDevice;
  readonly _currentRenderTarget: { readonly _disableEngineYFlip?: boolean } | null;
  readonly currentSampleCount: number;
  /** Starts the pass, if nothing was drawn. */
  _getCurrentRenderPass(): unknown;
  _getCurrentRenderPassWrapper(): {
    readonly renderPassDescriptor: GPURenderPassDescriptor | null;
    readonly depthTextureFormat: GPUTextureFormat | undefined;
    readonly colorAttachmentGPUTextures: readonly ({ readonly format: GPUTextureFormat } | null)[];
  };
  /** Ends the pass and submits it. The next draw call starts another that keeps its content. */
  flushFramebuffer(): void;
}

const METHODS = ["_getCurrentRenderPass", "_getCurrentRenderPassWrapper", "flushFramebuffer"] as const;

/** Draws at the end of the scene's draw phase: ends the engine's pass, and draws over what it drew. */
export class WebGpuHost extends GpuScene<Scene> {
  constructor(scene: Scene, depthAlpha: number | null) {
    super(internalsOf(scene)._device, depthAlpha);
  }

  draw(scene: Scene): void {
    const engine = scene.getEngine() as unknown as Internals;
    engine._getCurrentRenderPass();
    const { renderPassDescriptor, depthTextureFormat, colorAttachmentGPUTextures } = engine._getCurrentRenderPassWrapper();
    const color = (renderPassDescriptor?.colorAttachments as (GPURenderPassColorAttachment | null)[] | undefined)?.[0];
    const texture = colorAttachmentGPUTextures[0];
    if (!renderPassDescriptor || !color || !texture) throw unknown("the attachments of a pass");
    const { over } = this;
    over.color = color;
    over.format = texture.format;
    over.samples = engine.currentSampleCount;
    over.depth = renderPassDescriptor.depthStencilAttachment;
    over.depthFormat = depthTextureFormat;
    // The engine turns what it draws into textures upside down, as WebGL has them.
    const target = engine._currentRenderTarget;
    setView(this.view, scene, target !== null && !target._disableEngineYFlip ? "bottom" : "top");
    engine.flushFramebuffer();
    this.drawOver();
  }
}

function internalsOf(scene: Scene): Internals {
  const engine = scene.getEngine() as unknown as Internals;
  if (engine._device === undefined) throw unknown("a device");
  for (const name of METHODS) {
    if (typeof engine[name] !== "function") throw unknown(name);
  }
  return engine;
}

function unknown(what: string): AvatarError {
  return new AvatarError(`WebGPUEngine has not ${what} where it was in release 9.34; use that one`, { owner: "Babylon.js" });
}
