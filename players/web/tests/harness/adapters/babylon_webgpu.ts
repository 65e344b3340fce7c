import "@babylonjs/core/Engines/engine.js";
import { WebGPUEngine } from "@babylonjs/core/Engines/webgpuEngine.js";
import { sceneOf } from "./babylon_webgl.js";
import { QuietCanvas, watchErrors } from "./gpu.js";
import { flipped, type Stage, type StageOptions } from "./stage.js";

export async function makeStage(options: StageOptions): Promise<Stage> {
  const canvas = new QuietCanvas();
  const engine = new WebGPUEngine(canvas.element, { antialias: options.antialias });
  const noFiles = { jsPath: "/none.js", wasmPath: "/none.wasm" }; // its shaders for the plane exist as WGSL
  await engine.initAsync(noFiles, noFiles);
  return sceneOf(engine, options, async (target) => {
    if (target === null) return canvas.read();
    return flipped(new Uint8Array((await target.readPixels())!.buffer));
  }, watchErrors(engine._device));
}
