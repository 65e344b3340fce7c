// What draws avatars for a PlayCanvas application.

import type { AppBase, CameraComponent } from "playcanvas";
import { AvatarError } from "../errors.js";
import type { AvatarHost } from "../engine/host.js";

/** Draws avatars of one application. */
export interface Host extends AvatarHost {
  /** Draws what the camera sees into what the device draws into now. */
  draw(camera: CameraComponent): void;
}

/** `layer`: after which avatars are drawn. Throws AvatarError for a device with neither WebGL2 nor WebGPU. */
export async function hostOf(app: AppBase, layer: number, synchronous: boolean, onUpdate: () => void): Promise<Host> {
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
