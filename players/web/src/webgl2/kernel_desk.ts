// Answers messages with WebAssembly kernels: in a worker, or where the caller waits for the result.

import { KernelScene } from "./kernel_scene.js";
import type { SceneAnswer, QuadsMessage, SceneMessage } from "./messages.js";
import { endQuads, floatsOfQuads } from "./quads.js";

/** Holds the kernels' scene. Its answer is one object that changes with the next call. */
export class KernelDesk {
  private readonly scene: KernelScene;
  private readonly result: QuadsMessage = { kind: "quads", inputs: new Float32Array(0), quads: new Float32Array(0), count: 0 };

  constructor(kernels: WebAssembly.Module) {
    this.scene = new KernelScene(new WebAssembly.Instance(kernels));
  }

  /** The answer to a message; null where none is due. */
  answer(message: SceneMessage): SceneAnswer | null {
    try {
      return this.obey(message);
    } catch (error) {
      return { kind: "failed", message: error instanceof Error ? error.message : String(error) };
    }
  }

  private obey(message: SceneMessage): QuadsMessage | null {
    const { scene } = this;
    if (message.kind === "add") scene.add(message.id, message.program);
    else if (message.kind === "remove") scene.remove(message.id);
    else if (message.kind === "choose") scene.choose(message.ids);
    else return this.frame(scene, message.inputs, message.quads);
    return null;
  }

  private frame(of: KernelScene, inputs: Float32Array<ArrayBuffer>, quads: Float32Array<ArrayBuffer>): QuadsMessage {
    // Inputs of a scene that has changed since they were written do not fit; they go back unused.
    const count = inputs.length === of.inputs ? of.run(inputs) : 0;
    const room = floatsOfQuads(of.splats);
    const out = quads.length < room ? new Float32Array(room) : quads;
    out.set(of.quadFloats);
    endQuads(out, count);
    this.result.inputs = inputs;
    this.result.quads = out;
    this.result.count = count;
    return this.result;
  }
}
