// What a player needs of WebGPU or of WebGL2.

import type { Camera } from "./camera.js";
import type { Instance, InstanceHost } from "./instance.js";

/** Display-referred rgb in 0..1; null: transparent. */
export type Background = readonly [number, number, number] | null;

/** Draws instances that are sorted together. */
export interface Renderer extends InstanceHost {
  readonly kind: "webgpu" | "webgl2";
  /** Resolves with a reason when the GPU is lost; nothing is drawn afterwards. */
  readonly lost: Promise<string>;
  /** Splats of the last frame. */
  readonly splats: number;
  /** Images that were drawn so far. */
  readonly images: number;
  /** Uploads. Throws AvatarError where the avatar exceeds a limit of the GPU. */
  add(instance: Instance): void;
  /** Draws one frame onto the canvas. */
  frame(camera: Camera, background: Background): void;
  /** Resolves when the frame that was asked for last, or a newer one, is on the canvas. */
  finished(): Promise<void>;
  /** The last frame without its background: premultiplied [H, W, 4], first row on top. */
  readPixels(): Promise<Float32Array>;
  dispose(): void;
}
