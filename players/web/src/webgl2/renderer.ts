// The WebGL2 renderer: WebAssembly kernels in a worker, quads drawn by the GPU.

import type { Camera } from "../camera.js";
import type { Instance } from "../instance.js";
import type { Background, Renderer } from "../renderer.js";
import { GlDraw } from "./draw.js";
import type { QuadSource } from "./quad_source.js";

/** Draws instances onto a canvas of its own. A frame appears when the worker has computed it. */
export class WebGl2Renderer implements Renderer {
  readonly kind = "webgl2";
  readonly lost: Promise<string>;
  images = 0;
  private lose: (reason: string) => void = () => undefined;
  private readonly drawing: GlDraw;
  private background: Background = null;

  constructor(
    private readonly canvas: HTMLCanvasElement | OffscreenCanvas,
    gl: WebGL2RenderingContext,
    private readonly source: QuadSource,
  ) {
    this.drawing = new GlDraw(gl);
    this.lost = new Promise((resolve) => (this.lose = resolve));
    void source.lost.then(this.lose);
    canvas.addEventListener("webglcontextlost", this.onLost);
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
    this.canvas.removeEventListener("webglcontextlost", this.onLost);
    this.drawing.dispose();
    this.source.dispose();
  }

  private readonly onLost = (event: Event): void => {
    event.preventDefault();
    this.lose("the WebGL context was lost");
  };

  private draw(): void {
    const { quads, count, width, height } = this.source;
    if (this.canvas.width !== width) this.canvas.width = width;
    if (this.canvas.height !== height) this.canvas.height = height;
    this.drawing.upload(quads, count);
    this.drawing.accumulate(count, width, height);
    this.drawing.onto(this.background);
    this.images++;
  }
}
