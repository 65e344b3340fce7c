// Avatars in a Babylon.js engine on WebGL2.

import type { Scene } from "@babylonjs/core/scene.js";
import { AvatarError } from "../errors.js";
import { GlScene } from "../engine/gl_scene.js";
import { EngineView } from "../engine/view.js";
import type { DrawingHost } from "../engine/host.js";
import { setView } from "./view.js";

/** Draws at the end of the scene's draw phase, into the framebuffer that is bound. */
export class WebGlHost extends GlScene implements DrawingHost<[]> {
  private readonly view = new EngineView();

  constructor(private readonly scene: Scene, synchronous: boolean, onUpdate: () => void) {
    super(contextOf(scene), synchronous, onUpdate);
  }

  draw(): void {
    setView(this.view, this.scene, "bottom");
    this.drawInto(this.view);
  }
}

function contextOf(scene: Scene): WebGL2RenderingContext {
  // A canvas gives the context that it has.
  const gl = scene.getEngine().getRenderingCanvas()?.getContext("webgl2") ?? null;
  if (gl === null) throw new AvatarError("the engine has no canvas with WebGL2", { owner: "Babylon.js" });
  return gl;
}
