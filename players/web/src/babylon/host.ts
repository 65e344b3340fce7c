// What draws avatars for a Babylon.js engine: at the end of the scene's draw phase, into what is bound.

import type { Scene } from "@babylonjs/core/scene.js";
import { AvatarError } from "../errors.js";
import { depthAlphaOf, type AvatarHost, type AvatarSceneOptions } from "../engine/host.js";
import { setView } from "./view.js";

/** Throws AvatarError for an engine that draws with neither WebGL2 nor WebGPU. */
export async function hostOf(scene: Scene, options: AvatarSceneOptions, onUpdate: () => void): Promise<AvatarHost<Scene>> {
  const engine = scene.getEngine();
  if (engine.isWebGPU) {
    const { WebGpuHost } = await import("./webgpu.js");
    return new WebGpuHost(scene, depthAlphaOf(options));
  }
  if (engine.version < 2) throw new AvatarError("avatars need an engine with WebGL2 or WebGPU", { owner: "Babylon.js" });
  // A canvas gives the context that it has.
  const gl = engine.getRenderingCanvas()?.getContext("webgl2") ?? null;
  if (gl === null) throw new AvatarError("the engine has no canvas with WebGL2", { owner: "Babylon.js" });
  const { GlScene } = await import("../engine/gl_scene.js");
  return GlScene.create(gl, (view, seen) => setView(view, seen, "bottom"), options, onUpdate);
}
