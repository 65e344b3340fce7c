// What draws avatars for a PlayCanvas application.

import type { AppBase, CameraComponent } from "playcanvas";
import { AvatarError } from "../errors.js";
import type { DrawingHost } from "../engine/host.js";

/** `layer`: after which avatars are drawn. Throws AvatarError for a device with neither WebGL2 nor WebGPU. */
export async function hostOf(app: AppBase, layer: number, synchronous: boolean, onUpdate: () => void): Promise<DrawingHost<[CameraComponent]>> {
  const device = app.graphicsDevice;
  if (device.isWebGPU) {
    const { WebGpuHost } = await import("./webgpu.js");
    return new WebGpuHost(device, layer);
  }
  if (device.isWebGL2) {
    const { WebGlHost } = await import("./webgl.js");
    return new WebGlHost(device, synchronous, onUpdate);
  }
  throw new AvatarError("avatars need a graphics device with WebGL2 or WebGPU", { owner: "PlayCanvas" });
}
