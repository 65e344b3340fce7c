// What the pages of the benchmark share: the camera's path, and a frame that is really drawn.

/** What `window.start` gets. */
export interface Setup {
  readonly url: string; // of the avatar in the form that the page takes
  readonly size: number; // pixels, both ways
  readonly target: readonly [number, number, number]; // metres
  readonly distance: number; // metres
  readonly fovY: number; // radians
}

/** What the benchmark calls. */
export interface Page {
  /** Loads. It resolves when `step` may be called. */
  start(setup: Setup): Promise<void>;
  /** Draws frame `i` and resolves when the GPU has drawn it. */
  step(i: number): Promise<void>;
  /** Share of pixels that the last frame covers. It draws again if it must. */
  covered(): Promise<number>;
}

/** The camera's angle about the vertical in frame `i`, radians. */
export function yawOf(i: number): number {
  return 0.3 * Math.sin(0.37 * i);
}

/** Where the camera of frame `i` is. */
export function eyeOf({ target, distance }: Setup, i: number): [number, number, number] {
  const yaw = yawOf(i);
  return [target[0] + distance * Math.sin(yaw), target[1], target[2] + distance * Math.cos(yaw)];
}

const pixel = new Uint8Array(4);

/** Waits until the context has drawn all that it was told: a read of one pixel. Call it in the task that drew. */
export function finish(gl: WebGL2RenderingContext): void {
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
}

/** Share of the canvas that differs from its first pixel. Call it in the task that drew. */
export function coverage(gl: WebGL2RenderingContext): number {
  const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
  const bytes = new Uint8Array(4 * width * height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  let differ = 0;
  for (let at = 0; at < bytes.length; at += 4) {
    const far = Math.max(...[0, 1, 2].map((c) => Math.abs((bytes[at + c] as number) - (bytes[c] as number))));
    if (far > 8) differ++;
  }
  return differ / (width * height);
}

/** Callbacks of requestAnimationFrame run only when `run` is called. */
export function steppedAnimation(): { run(milliseconds: number): void } {
  let waiting: FrameRequestCallback[] = [];
  window.requestAnimationFrame = (callback) => waiting.push(callback);
  return {
    run(milliseconds) {
      const now = waiting;
      waiting = [];
      for (const callback of now) callback(milliseconds);
    },
  };
}

/** A canvas of the page's size. */
export function makeCanvas(size: number): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = size;
  canvas.style.cssText = `width:${size}px;height:${size}px;display:block`;
  document.body.append(canvas);
  return canvas;
}

/** Gives the page to the benchmark. */
export function offer(page: Page): void {
  Object.assign(window, { start: page.start, step: page.step, covered: page.covered });
}

/** Lets workers answer. */
export function pause(milliseconds = 0): Promise<void> {
  return new Promise((done) => setTimeout(done, milliseconds));
}
