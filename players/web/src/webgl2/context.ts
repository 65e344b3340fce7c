import { AvatarError } from "../errors.js";

/** A canvas that nobody sees. WebKitGTK has no WebGL on an OffscreenCanvas, and workers have no other. */
export function hiddenCanvas(): HTMLCanvasElement | OffscreenCanvas {
  return typeof document === "undefined" ? new OffscreenCanvas(1, 1) : document.createElement("canvas");
}

/** The context of a canvas. Throws AvatarError where there is none. */
export function requestContext(canvas: HTMLCanvasElement | OffscreenCanvas): WebGL2RenderingContext {
  const gl = canvas.getContext("webgl2", { alpha: true, premultipliedAlpha: true, antialias: false, depth: false, stencil: false, powerPreference: "high-performance" });
  if (gl === null) throw new AvatarError("this browser has neither WebGPU nor WebGL2; use a newer one, or turn hardware acceleration on");
  return gl as WebGL2RenderingContext;
}
