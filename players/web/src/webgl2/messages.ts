// What the renderer and its worker say to each other.

import type { Interface } from "../made/reflection.js";
import type { KernelProgram } from "./kernel_scene.js";

/** To the worker, which serves all scenes of a page: whose message it is. */
export type ToWorker = StartMessage | ((SceneMessage | { readonly kind: "end" }) & Addressed);

/** The number of a scene. */
export interface Addressed {
  scene?: number;
}

/** The first message to a worker, which answers that it is ready. */
export interface StartMessage {
  readonly kind: "start";
  readonly kernels: WebAssembly.Module;
  readonly interfaces: Readonly<Record<string, Interface>>;
}

/** What a scene does. `inputs` and `quads` are lent and come back with the result. */
export type SceneMessage =
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
export type FromWorker = { readonly kind: "ready" } | (SceneAnswer & Addressed);

/** What a scene answers. */
export type SceneAnswer = QuadsMessage | { readonly kind: "failed"; readonly message: string };
