// Avatars on a PlayCanvas graphics device with WebGL2.

import type { CameraComponent, GraphicsDevice } from "playcanvas";
import { AvatarError } from "../errors.js";
import { GlScene } from "../engine/gl_scene.js";
import { EngineView } from "../engine/view.js";
import type { DrawingHost } from "../engine/host.js";
import { setView } from "./view.js";

/** Draws between two layers, into the framebuffer that is bound. */
export class WebGlHost extends GlScene implements DrawingHost<[CameraComponent]> {
  private readonly view = new EngineView();

  constructor(private readonly device: GraphicsDevice, synchronous: boolean, onUpdate: () => void) {
    super(contextOf(device), synchronous, onUpdate);
  }

  draw(camera: CameraComponent): void {
    setView(this.view, camera, this.device);
    this.drawInto(this.view);
  }
}

function contextOf(device: GraphicsDevice): WebGL2RenderingContext {
  // A canvas gives the context that it has.
  const gl = device.canvas.getContext("webgl2");
  if (gl === null) throw new AvatarError("the canvas of the device has no WebGL2", { owner: "PlayCanvas" });
  return gl as WebGL2RenderingContext;
}
