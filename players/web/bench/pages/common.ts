// What the pages of the benchmark share: the camera's path, and a frame that is really drawn.

/** What `window.start` gets. */
export interface Setup {
  readonly url: string; // of the avatar in the form that the page takes
  readonly size: number; // pixels, both ways
  readonly target: readonly [number, number, number]; // metres
  readonly distance: number; // metres
  readonly fovY: number; // radians
}

/** A renderer that has loaded its avatar. */
export interface Drawing {
  readonly gl?: WebGL2RenderingContext;
  /** Instead of `gl`: a canvas that pictures are copied to. */
  readonly canvas?: HTMLCanvasElement;
  /** Draws frame `i`; its promise, if it gives one, resolves when the worker has computed the frame. */
  draw(i: number): void | Promise<void> | undefined;
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

/** Share of the canvas that differs from its first pixel. Call it in the task that drew. */
function coverage(canvas: HTMLCanvasElement): number {
  const { width, height } = canvas;
  const context = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d") as CanvasRenderingContext2D;
  context.fillStyle = "#fff"; // where the canvas is clear
  context.fillRect(0, 0, width, height);
  context.drawImage(canvas, 0, 0);
  const bytes = context.getImageData(0, 0, width, height).data;
  let differ = 0;
  for (let at = 0; at < bytes.length; at += 4) {
    if ([0, 1, 2].some((c) => Math.abs((bytes[at + c] as number) - (bytes[c] as number)) > 8)) differ++;
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

/** Lets workers answer. */
export function pause(milliseconds = 0): Promise<void> {
  return new Promise((done) => setTimeout(done, milliseconds));
}

/**
 * Gives the page to the benchmark: `start` loads with `make` and draws for `warmMs`; `step` draws a frame and waits
 * until the GPU has drawn it; `covered` is the share of pixels that a frame covers.
 */
export function offer(make: (setup: Setup) => Promise<Drawing>, warmMs = 800): void {
  const pixel = new Uint8Array(4);
  const probe = document.createElement("canvas").getContext("2d", { willReadFrequently: true }) as CanvasRenderingContext2D;
  let drawing: Drawing;
  Object.assign(window, {
    async start(setup: Setup) {
      drawing = await make(setup);
      const end = performance.now() + warmMs;
      for (let i = 0; performance.now() < end; i++) {
        await drawing.draw(i);
        await pause(50);
      }
    },
    async step(i: number) {
      const { gl, canvas } = drawing;
      await drawing.draw(i);
      if (canvas !== undefined) probe.drawImage(canvas, 0, 0, 1, 1);
      probe.getImageData(0, 0, 1, 1);
      gl?.bindFramebuffer(gl.FRAMEBUFFER, null);
      gl?.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      await pause();
    },
    async covered() {
      await drawing.draw(0);
      await pause(1000); // workers that sort
      await drawing.draw(0);
      return coverage(drawing.canvas ?? (drawing.gl?.canvas as HTMLCanvasElement));
    },
  });
}
