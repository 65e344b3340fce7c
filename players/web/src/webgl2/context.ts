import { AvatarError } from "../errors.js";
import { Shared } from "../shared.js";
import { GlPrograms } from "./draw.js";

/** A canvas that nobody sees. WebKitGTK has no WebGL on an OffscreenCanvas, and workers have no other. Throws AvatarError. */
export function hiddenCanvas(): HTMLCanvasElement | OffscreenCanvas {
  if (typeof OffscreenCanvas === "undefined" && typeof document === "undefined") {
    throw new AvatarError("avatars are drawn in browsers; here, as in Node, is neither WebGPU nor a canvas");
  }
  return typeof document === "undefined" ? new OffscreenCanvas(1, 1) : document.createElement("canvas");
}

/** The context of a canvas. Throws AvatarError where there is none. */
export function requestContext(canvas: HTMLCanvasElement | OffscreenCanvas): WebGL2RenderingContext {
  const gl = canvas.getContext("webgl2", { alpha: true, premultipliedAlpha: true, antialias: false, depth: false, stencil: false, powerPreference: "high-performance" });
  if (gl === null) {
    throw new AvatarError(
      "this browser has neither WebGPU nor WebGL2, so it cannot draw avatars; use a current Chrome, Edge, Firefox or Safari, and switch hardware acceleration on in its settings",
    );
  }
  return gl as WebGL2RenderingContext;
}

/** Where pictures are copied to. */
export type Drawable = CanvasRenderingContext2D | OffscreenCanvasRenderingContext2D;

/**
 * The context that all players of a page draw with. Each copies its picture onto its own canvas: browsers end the oldest
 * context of a page where there are more than about 16, which may be the page's own. It stays, empty, when nobody draws:
 * WebKit counts those that were ended, too.
 */
export class PageContext {
  readonly gl: WebGL2RenderingContext;
  /** Released by the last player, the context holds nothing. */
  readonly programs: Shared<GlPrograms>;
  readonly canvas = hiddenCanvas();

  /** Throws AvatarError where there is no WebGL2. */
  constructor() {
    const { canvas } = this;
    const gl = (this.gl = requestContext(canvas));
    const free = (programs: GlPrograms): void => {
      programs.dispose();
      canvas.width = canvas.height = 1;
    };
    this.programs = new Shared(() => new GlPrograms(gl), free);
  }

  /** Makes room for a picture of that size, at the lower left. Call it before drawing it. */
  fit(width: number, height: number): void {
    if (this.canvas.width < width) this.canvas.width = width;
    if (this.canvas.height < height) this.canvas.height = height;
  }

  /** Copies the picture onto a canvas, which takes its size. */
  copy(width: number, height: number, onto: Drawable): void {
    const { canvas } = onto;
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    onto.globalCompositeOperation = "copy"; // a new size resets it
    onto.drawImage(this.canvas, 0, this.canvas.height - height, width, height, 0, 0, width, height);
  }
}

let current: PageContext | null = null;

/** The context of this page or worker. Throws AvatarError where there is no WebGL2. */
export function pageContext(): PageContext {
  if (current === null || current.gl.isContextLost()) current = new PageContext();
  return current;
}
