// Starts the WebGL2 renderer: context, kernels, worker. It is loaded only where it is used.

import { AvatarError } from "../errors.js";
import { pageContext } from "./context.js";
import { QuadSource } from "./quad_source.js";
import { WebGl2Renderer } from "./renderer.js";
import { openPort } from "./scene_port.js";

/**
 * `canvas`: null for no canvas. Throws AvatarError where the browser has no WebGL2, another context has the canvas, and
 * as `openPort` does.
 */
export async function startWebGl2(canvas: HTMLCanvasElement | OffscreenCanvas | null): Promise<WebGl2Renderer> {
  pageContext();
  const shown = canvas?.getContext("2d") ?? null;
  if (canvas !== null && shown === null) throw new AvatarError("the canvas has another context already", { field: "WebGL2" });
  const port = await openPort();
  try {
    return new WebGl2Renderer(shown, pageContext(), new QuadSource(port));
  } catch (error) {
    port.terminate();
    throw error;
  }
}
