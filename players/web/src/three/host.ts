// What draws avatars for a three.js renderer.

import type { Camera, WebGLRenderer } from "three";
import type { WebGPURenderer } from "three/webgpu";
import { AvatarError } from "../errors.js";
import type { DrawingHost } from "../engine/host.js";
import type { Backend } from "./context.js";

/** Throws AvatarError for a renderer that draws with neither WebGL2 nor WebGPU. */
export async function hostOf(renderer: WebGLRenderer | WebGPURenderer, synchronous: boolean, onUpdate: () => void): Promise<DrawingHost<[Camera]>> {
  if ("isWebGPURenderer" in renderer) {
    await renderer.init();
    const backend = renderer.backend as unknown as Backend;
    if (backend.gl !== undefined) {
      const { FallbackHost } = await import("./fallback.js");
      return new FallbackHost(renderer, backend.gl, synchronous, onUpdate);
    }
    const { WebGpuHost } = await import("./webgpu.js");
    return new WebGpuHost(renderer, backend);
  }
  if ("isWebGLRenderer" in renderer) {
    const { WebGlHost } = await import("./webgl.js");
    return new WebGlHost(renderer as WebGLRenderer, synchronous, onUpdate);
  }
  throw new AvatarError("AvatarScene takes a WebGLRenderer or a WebGPURenderer", { owner: "three.js" });
}
