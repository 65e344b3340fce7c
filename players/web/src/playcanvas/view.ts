import { GAMMA_NONE, type CameraComponent, type GraphicsDevice, type RenderTarget } from "playcanvas";
import { AvatarError } from "../errors.js";
import type { EngineView } from "../engine/view.js";

/** Takes a camera and what its device draws into now. */
export function setView(view: EngineView, camera: CameraComponent, device: GraphicsDevice): void {
  const target = targetOf(device);
  const { width, height } = target;
  const { rect } = camera;
  const x = Math.floor(rect.x * width), w = Math.floor(rect.z * width);
  const y = Math.floor(rect.y * height), h = Math.floor(rect.w * height);
  // Row 0 of a texture is the top one with WebGPU, and where PlayCanvas flips what WebGL draws.
  const firstRow = device.isWebGPU !== target.flipY ? "top" : "bottom";
  view.setViewport(x, device.isWebGPU && !target.flipY ? height - y - h : y, w, h);
  view.linear = camera.gammaCorrection === GAMMA_NONE || target.isColorBufferSrgb(0);
  view.reversed = false;
  view.setCamera(camera.viewMatrix.data, camera.projectionMatrix.data, "minus_one_to_one", firstRow, width, height);
}

/** What is drawn into now: inside an event of a pass no public name says it. */
function targetOf(device: GraphicsDevice): RenderTarget {
  const { renderTarget, backBuffer } = device as unknown as { renderTarget?: RenderTarget | null; backBuffer?: RenderTarget };
  const target = renderTarget ?? backBuffer;
  if (target === undefined) throw new AvatarError("the graphics device names no render target; release 2.23 was tried", { owner: "PlayCanvas" });
  return target;
}
