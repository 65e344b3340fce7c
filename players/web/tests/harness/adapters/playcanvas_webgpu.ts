import * as pc from "playcanvas";
import { sceneOf } from "./playcanvas_webgl.js";
import { QuietCanvas, watchErrors } from "./gpu.js";
import { SIZE, type Stage, type StageOptions } from "./stage.js";

export async function makeStage(options: StageOptions): Promise<Stage> {
  const canvas = new QuietCanvas();
  const device = await pc.createGraphicsDevice(canvas.element, { deviceTypes: ["webgpu"], antialias: options.antialias });
  device.maxPixelRatio = 1;
  return sceneOf(device, options, async (target) => {
    if (target === null) return canvas.read();
    return (await target.colorBuffer!.read(0, 0, SIZE, SIZE, { immediate: true })) as Uint8Array;
  }, watchErrors((device as unknown as { wgpu: GPUDevice }).wgpu));
}
