// What the renderer and its worker say to each other.

import type { KernelProgram } from "./kernel_scene.js";

/** To the worker. `inputs` and `quads` are lent and come back with the result. */
export type ToWorker =
  | { readonly kind: "start"; readonly kernels: ArrayBuffer }
  | { readonly kind: "add"; readonly id: number; readonly program: KernelProgram }
  | { readonly kind: "remove"; readonly id: number }
  | { readonly kind: "choose"; readonly ids: readonly number[] }
  | FrameMessage;

/** One frame to compute. */
export interface FrameMessage {
  kind: "frame";
  inputs: Float32Array<ArrayBuffer>;
  quads: Float32Array<ArrayBuffer>;
}

/** Quads of a frame, back to front: the first `count` of them. */
export interface QuadsMessage {
  kind: "quads";
  inputs: Float32Array<ArrayBuffer>;
  quads: Float32Array<ArrayBuffer>;
  count: number;
}

/** From the worker. */
export type FromWorker = QuadsMessage | { readonly kind: "failed"; readonly message: string };
