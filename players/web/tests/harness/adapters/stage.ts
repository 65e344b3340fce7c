// What a test asks of an engine: a scene of 128 x 128 pixels with a wall, and avatars.

import type { Avatar } from "../../../src/avatar.js";

export const SIZE = 128;
export const FOV_Y = 0.6; // radians
/** Colours as displayed, 0..255. */
export const BACKGROUND = [40, 60, 120] as const;
export const WALL = [200, 90, 30] as const;

/** An avatar in the scene of an engine. */
export interface Actor {
  /** Position; rotation about +y, radians; scale. */
  place(x: number, y: number, z: number, yaw: number, scale: number): void;
  show(visible: boolean): void;
  dispose(): void;
}

/** The scene of an engine. The camera looks along -z at the origin from `distance`. */
export interface Stage {
  add(avatar: Avatar): Actor;
  /** An opaque plane that faces the camera: where x < 0 and z is `z`; null: hidden. */
  wall(z: number | null): void;
  /** Draws until the worker has nothing newer; RGBA bytes as displayed, first row on top. */
  picture(): Promise<Uint8Array>;
  /** Of stages with WebGL: loses the context, and gives it back. */
  lose?(): Promise<void>;
  /** The scene is seen by an orthographic camera, or again by the other. */
  orthographic?(on: boolean): void;
  /** Frees the avatars and what drew them; the scene goes on. */
  disposeAvatars(): void;
  /** Errors of the graphics interface since the last call. */
  errors(): Promise<string[]>;
}

/** Options of a stage. */
export interface StageOptions {
  readonly api: "webgl2" | "webgpu";
  readonly distance: number;
  readonly synchronous: boolean;
  readonly antialias: boolean;
  readonly target: boolean; // draws into a render target of the engine, else onto the canvas
  readonly linear?: boolean; // of the player alone: blends over the background in linear light
  readonly reversed?: boolean; // of three.js alone: a reversed depth buffer
  readonly leftHanded?: boolean; // of Babylon.js alone
}

/** Numbers of 0..255, rounded outside. */
export function clamped(values: readonly number[]): Uint8Array {
  return new Uint8Array(Uint8ClampedArray.from(values).buffer);
}

/** Rows of what WebGL read, first row on top. */
export function flipped(pixels: ArrayLike<number>): Uint8Array {
  const out = new Uint8ClampedArray(4 * SIZE * SIZE);
  for (let y = 0; y < SIZE; y++) {
    for (let i = 0; i < 4 * SIZE; i++) out[4 * SIZE * y + i] = pixels[4 * SIZE * (SIZE - 1 - y) + i] as number;
  }
  return new Uint8Array(out.buffer);
}

/** What WebGL draws onto its canvas, right after it was drawn. */
export function readCanvas(gl: WebGL2RenderingContext): Uint8Array {
  const pixels = new Uint8Array(4 * SIZE * SIZE);
  const bound = gl.getParameter(gl.READ_FRAMEBUFFER_BINDING) as WebGLFramebuffer | null;
  gl.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
  gl.readPixels(0, 0, SIZE, SIZE, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  gl.bindFramebuffer(gl.READ_FRAMEBUFFER, bound);
  return flipped(pixels);
}

/** Loses a context, and gives it back; resolves when the engine has both heard. */
export async function loseContext(gl: WebGL2RenderingContext): Promise<void> {
  const extension = gl.getExtension("WEBGL_lose_context") as WEBGL_lose_context;
  for (const [event, run] of [["webglcontextlost", () => extension.loseContext()], ["webglcontextrestored", () => extension.restoreContext()]] as const) {
    const told = new Promise((resolve) => gl.canvas.addEventListener(event, resolve, { once: true }));
    run();
    await told;
    await new Promise((resolve) => setTimeout(resolve)); // a context may be restored in a later task alone
  }
}

/** Errors of a WebGL context. */
export function glErrors(gl: WebGL2RenderingContext): string[] {
  const found: string[] = [];
  for (let code = gl.getError(); code !== gl.NO_ERROR; code = gl.getError()) found.push(`WebGL error ${code}`);
  return found;
}
