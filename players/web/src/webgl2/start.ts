// Starts the WebGL2 renderer: context, kernels, worker. It is loaded only where it is used.

import { requestContext } from "./context.js";
import { QuadSource } from "./quad_source.js";
import { WebGl2Renderer } from "./renderer.js";
import { startWorker } from "./start_worker.js";

/** Throws AvatarError where the browser has no WebGL2. */
export function startWebGl2(canvas: HTMLCanvasElement | OffscreenCanvas): WebGl2Renderer {
  const gl = requestContext(canvas);
  return new WebGl2Renderer(canvas, gl, new QuadSource(startWorker()));
}
