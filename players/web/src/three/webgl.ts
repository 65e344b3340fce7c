// Avatars under WebGLRenderer.

import { LinearSRGBColorSpace, Vector2, Vector4, type Camera, type WebGLRenderer } from "three";
import { GlScene } from "../engine/gl_scene.js";
import { EngineView } from "../engine/view.js";
import type { DrawingHost } from "../engine/host.js";

const SIZE = new Vector2();
const VIEWPORT = new Vector4();

/** Draws in the middle of the renderer's pass, into the framebuffer that is bound. */
export class WebGlHost extends GlScene implements DrawingHost<[Camera]> {
  private readonly view = new EngineView();

  constructor(private readonly renderer: WebGLRenderer, synchronous: boolean, onUpdate: () => void) {
    super(renderer.getContext() as WebGL2RenderingContext, synchronous, onUpdate);
  }

  draw(camera: Camera): void {
    const { renderer, view } = this;
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
    this.drawInto(view);
  }
}
