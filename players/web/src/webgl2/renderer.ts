// The WebGL2 renderer: WebAssembly kernels in a worker, quads drawn by the GPU.

import type { Camera } from "../camera.js";
import type { Instance } from "../instance.js";
import type { Background, Renderer } from "../renderer.js";
import type { Lease } from "../shared.js";
import type { Drawable, PageContext } from "./context.js";
import { GlDraw, type GlPrograms } from "./draw.js";
import type { QuadSource } from "./quad_source.js";

/** Draws instances with the context of the page, and copies the picture. A frame appears when the worker has computed it. */
export class WebGl2Renderer implements Renderer {
  readonly kind = "webgl2";
  readonly lost: Promise<string>;
  images = 0;
  private lose: (reason: string) => void = () => undefined;
  private readonly programs: Lease<GlPrograms>;
  private readonly drawing: GlDraw;
  private background: Background = null;

  /** `shown`: null where nothing is shown. Throws AvatarError where the context cannot draw into floats. */
  constructor(
    private readonly shown: Drawable | null,
    private readonly context: PageContext,
    private readonly source: QuadSource,
  ) {
    this.programs = context.programs.take();
    try {
      this.drawing = new GlDraw(context.gl, this.programs.value);
    } catch (error) {
      this.programs.release();
      throw error;
    }
    this.lost = new Promise((resolve) => (this.lose = resolve));
    void source.lost.then(this.lose);
    context.canvas.addEventListener("webglcontextlost", this.onLost);
    source.most = this.drawing.most;
    source.onQuads = () => this.draw();
  }

  get splats(): number {
    return this.source.count;
  }

  add(instance: Instance): void {
    this.source.add(instance);
  }

  changed(instance: Instance): void {
    this.source.changed(instance);
  }

  remove(instance: Instance): void {
    this.source.remove(instance);
  }

  frame(camera: Camera, background: Background): void {
    this.background = background;
    this.source.frame(camera);
  }

  finished(): Promise<void> {
    return this.source.finished();
  }

  readPixels(): Promise<Float32Array> {
    return Promise.resolve(this.drawing.read());
  }

  dispose(): void {
    this.context.canvas.removeEventListener("webglcontextlost", this.onLost);
    this.drawing.dispose();
    this.source.dispose();
    this.programs.release();
  }

  private readonly onLost = (): void => this.lose("the WebGL context was lost");

  private draw(): void {
    const { quads, count, width, height } = this.source;
    const { drawing, shown, context } = this;
    drawing.upload(quads, count);
    drawing.accumulate(count, width, height);
    if (shown !== null) {
      context.fit(width, height);
      drawing.onto(this.background);
      context.copy(width, height, shown);
    }
    this.images++;
  }
}
