// What draws avatars for a Babylon.js engine.

import type { Scene } from "@babylonjs/core/scene.js";
import { AvatarError } from "../errors.js";
import type { AvatarHost } from "../engine/host.js";

/** Draws avatars of one scene. */
export interface Host extends AvatarHost {
  /** Draws what the scene's active camera sees into what the engine draws into now. */
  draw(): void;
}

/** Throws AvatarError for an engine that draws with neither WebGL2 nor WebGPU. */
export async function hostOf(scene: Scene, synchronous: boolean, onUpdate: () => void): Promise<Host> {
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
