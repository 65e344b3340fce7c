// What draws avatars for a PlayCanvas application: between two layers, into what is bound.

import type { AppBase, CameraComponent } from "playcanvas";
import { AvatarError } from "../errors.js";
import { depthAlphaOf, type AvatarHost, type AvatarSceneOptions } from "../engine/host.js";
import { setView } from "./view.js";

/** `layer`: after which avatars are drawn. Throws AvatarError for a device with neither WebGL2 nor WebGPU. */
export async function hostOf(app: AppBase, layer: number, options: AvatarSceneOptions, onUpdate: () => void): Promise<AvatarHost<CameraComponent>> {
  const device = app.graphicsDevice;
  if (device.isWebGPU) {
    const { WebGpuHost } = await import("./webgpu.js");
    return new WebGpuHost(device, layer, depthAlphaOf(options));
  }
  // A canvas gives the context that it has.
  const gl = device.isWebGL2 ? (device.canvas.getContext("webgl2") as WebGL2RenderingContext | null) : null;
  if (gl === null) throw new AvatarError("avatars need a graphics device with WebGL2 or WebGPU", { owner: "PlayCanvas" });
  const { GlScene } = await import("../engine/gl_scene.js");
  return GlScene.create(gl, (view, camera) => setView(view, camera, device), options, onUpdate);
}
