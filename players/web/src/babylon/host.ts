// What draws avatars for a Babylon.js engine.

import type { Scene } from "@babylonjs/core/scene.js";
import { AvatarError } from "../errors.js";
import type { DrawingHost } from "../engine/host.js";

/** Throws AvatarError for an engine that draws with neither WebGL2 nor WebGPU. */
export async function hostOf(scene: Scene, synchronous: boolean, onUpdate: () => void): Promise<DrawingHost<[]>> {
  const engine = scene.getEngine();
  if (engine.isWebGPU) {
    const { WebGpuHost } = await import("./webgpu.js");
    return new WebGpuHost(scene);
  }
  if (engine.version >= 2) {
    const { WebGlHost } = await import("./webgl.js");
    return new WebGlHost(scene, synchronous, onUpdate);
  }
  throw new AvatarError("avatars need an engine with WebGL2 or WebGPU", { owner: "Babylon.js" });
}
