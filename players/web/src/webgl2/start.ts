// Starts the WebGL2 renderer: context, kernels, worker. It is loaded only where it is used.

import { hiddenCanvas, requestContext } from "./context.js";
import { QuadSource } from "./quad_source.js";
import { WebGl2Renderer } from "./renderer.js";
import { startWorker } from "./start_worker.js";

/** `wanted`: null for no canvas. Throws AvatarError where the browser has no WebGL2. */
export function startWebGl2(wanted: HTMLCanvasElement | OffscreenCanvas | null): WebGl2Renderer {
  const canvas = wanted ?? hiddenCanvas();
  return new WebGl2Renderer(canvas, requestContext(canvas), new QuadSource(startWorker()));
}
