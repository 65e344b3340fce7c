import { AvatarError } from "../errors.js";

/** The context of a canvas. Throws AvatarError where there is none. */
export function requestContext(canvas: HTMLCanvasElement | OffscreenCanvas): WebGL2RenderingContext {
  const gl = canvas.getContext("webgl2", { alpha: true, premultipliedAlpha: true, antialias: false, depth: false, stencil: false, powerPreference: "high-performance" });
  if (gl === null) throw new AvatarError("this browser has neither WebGPU nor WebGL2; use a newer one, or turn hardware acceleration on");
  return gl as WebGL2RenderingContext;
}
