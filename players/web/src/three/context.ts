// What WebGPURenderer draws into and with which camera: its internal names, in one place.

import type { Camera, Vector4 } from "three";
import type { WebGPURenderer } from "three/webgpu";
import { AvatarError } from "../errors.js";
import type { EngineView } from "../engine/view.js";

/** What we read of three.js besides its public names. */
export interface RenderContext {
  readonly width: number;
  readonly height: number;
  readonly viewport: boolean;
  readonly viewportValue: Vector4; // y counts from the top
}
export interface Backend {
  readonly device?: GPUDevice;
  readonly gl?: WebGL2RenderingContext;
  readonly utils: {
    getCurrentColorFormat(context: RenderContext): GPUTextureFormat;
    getCurrentDepthStencilFormat(context: RenderContext): GPUTextureFormat | undefined;
    getSampleCountRenderContext(context: RenderContext): number;
  };
  get(context: RenderContext): { readonly descriptor?: GPURenderPassDescriptor };
  finishRender(context: RenderContext): void;
}

/** Both need what three.js calls a render context. Throws AvatarError where this release has none. */
export function contextOf(renderer: WebGPURenderer): RenderContext {
  const context = (renderer as unknown as { _currentRenderContext?: RenderContext | null })._currentRenderContext;
  if (!context?.viewportValue) throw unknown("a render context");
  return context;
}

export function unknown(what: string): AvatarError {
  return new AvatarError(`WebGPURenderer has not ${what} where it was in release 187; use that one`, { owner: "three.js" });
}

export function setView(view: EngineView, camera: Camera, context: RenderContext, firstRow: "top" | "bottom"): void {
  const { width, height, viewportValue: part } = context;
  if (context.viewport) view.setViewport(part.x, firstRow === "top" ? part.y : height - part.y - part.w, part.z, part.w);
  else view.setViewport(0, 0, width, height);
  // Everything is drawn in linear light first.
  view.linear = true;
  view.reversed = camera.reversedDepth;
  const range = firstRow === "top" || view.reversed ? "zero_to_one" : "minus_one_to_one";
  view.setCamera(camera.matrixWorldInverse.elements, camera.projectionMatrix.elements, range, firstRow, width, height);
}
