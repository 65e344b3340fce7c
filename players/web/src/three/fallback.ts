// Avatars under WebGPURenderer on WebGL2.

import type { Camera } from "three";
import type { WebGPURenderer } from "three/webgpu";
import { GlScene } from "../engine/gl_scene.js";
import { EngineView } from "../engine/view.js";
import { contextOf, setView } from "./context.js";
import type { DrawingHost } from "../engine/host.js";

/** Draws in the middle of a pass, where the renderer has fallen back to WebGL2. */
export class FallbackHost extends GlScene implements DrawingHost<[Camera]> {
  private readonly view = new EngineView();

  constructor(private readonly renderer: WebGPURenderer, gl: WebGL2RenderingContext, synchronous: boolean, onUpdate: () => void) {
    super(gl, synchronous, onUpdate);
  }

  draw(camera: Camera): void {
    setView(this.view, camera, contextOf(this.renderer), "bottom");
    this.drawInto(this.view);
  }
}
