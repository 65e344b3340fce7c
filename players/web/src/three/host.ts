// What draws avatars for a three.js renderer.

import { LinearSRGBColorSpace, Vector2, Vector4, type Camera, type WebGLRenderer } from "three";
import type { WebGPURenderer } from "three/webgpu";
import { AvatarError } from "../errors.js";
import { depthAlphaOf, type AvatarHost, type AvatarSceneOptions } from "../engine/host.js";
import type { EngineView } from "../engine/view.js";
import { contextOf, setView, type Backend } from "./context.js";

const SIZE = new Vector2();
const VIEWPORT = new Vector4();

/** Throws AvatarError for a renderer that draws with neither WebGL2 nor WebGPU. */
export async function hostOf(renderer: WebGLRenderer | WebGPURenderer, options: AvatarSceneOptions, onUpdate: () => void): Promise<AvatarHost<Camera>> {
  let gl: WebGL2RenderingContext;
  let look: (view: EngineView, camera: Camera) => void;
  if ("isWebGPURenderer" in renderer) {
    await renderer.init();
    const backend = renderer.backend as unknown as Backend;
    if (backend.gl === undefined) {
      const { WebGpuHost } = await import("./webgpu.js");
      return new WebGpuHost(renderer, backend, depthAlphaOf(options));
    }
    gl = backend.gl;
    look = (view, camera) => setView(view, camera, contextOf(renderer), "bottom");
  } else if ("isWebGLRenderer" in renderer) {
    gl = renderer.getContext() as WebGL2RenderingContext;
    look = (view, camera) => lookBound(view, camera, renderer as WebGLRenderer);
  } else {
    throw new AvatarError("AvatarScene takes a WebGLRenderer or a WebGPURenderer", { owner: "three.js" });
  }
  const { GlScene } = await import("../engine/gl_scene.js");
  return GlScene.create(gl, look, options, onUpdate);
}

/** What a camera sees in the middle of a pass of WebGLRenderer. */
function lookBound(view: EngineView, camera: Camera, renderer: WebGLRenderer): void {
  const target = renderer.getRenderTarget();
  if (target === null) renderer.getDrawingBufferSize(SIZE);
  else SIZE.set(target.width, target.height);
  renderer.getCurrentViewport(VIEWPORT);
  view.setViewport(VIEWPORT.x, VIEWPORT.y, VIEWPORT.z, VIEWPORT.w);
  // Targets hold linear light; three.js converts when it draws onto the canvas.
  view.linear = target !== null || renderer.outputColorSpace === LinearSRGBColorSpace;
  view.reversed = camera.reversedDepth;
  const range = view.reversed ? "zero_to_one" : "minus_one_to_one";
  view.setCamera(camera.matrixWorldInverse.elements, camera.projectionMatrix.elements, range, "bottom", SIZE.x, SIZE.y);
}
