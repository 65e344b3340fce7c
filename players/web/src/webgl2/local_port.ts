// Kernels on the thread of the caller, behind the face of a worker.

import { KernelDesk } from "./kernel_desk.js";
import type { SceneAnswer, SceneMessage } from "./messages.js";
import type { QuadPort } from "./quad_source.js";

/** Computes each frame before `postMessage` returns. */
export class LocalPort implements QuadPort {
  onmessage: QuadPort["onmessage"] = null;
  onerror: QuadPort["onerror"] = null;
  private readonly desk: KernelDesk;
  private readonly event: { data: SceneAnswer | null } = { data: null };

  constructor(kernels: WebAssembly.Module) {
    this.desk = new KernelDesk(kernels);
  }

  postMessage(message: SceneMessage): void {
    this.event.data = this.desk.answer(message);
    if (this.event.data !== null) (this.onmessage as (event: unknown) => void)(this.event);
  }

  terminate(): void {
    this.onmessage = null;
  }
}
