// Single stages with the WebAssembly kernels and WebGL2, for conformance.

import type { Avatar } from "../avatar.js";
import type { Camera } from "../camera.js";
import type { StageRunner } from "../conform/stages.js";
import { Instance } from "../instance.js";
import type { Level } from "../pack/model.js";
import type { Lease } from "../shared.js";
import { GlDraw, type GlPrograms } from "./draw.js";
import { KernelScene, kernelProgram, type KernelAvatar } from "./kernel_scene.js";
import { pageContext } from "./context.js";
import { floatsOfQuads } from "./quads.js";

const NO_HOST = { changed: () => undefined, remove: () => undefined };
const ID = 1;
const FLOATS = 12; // of a quad

/** One avatar at its finest level. Without a canvas (Node) it runs all stages but raster. */
export class WebGl2Stages implements StageRunner {
  readonly level: Level;
  private readonly instance: Instance;
  private readonly scene: KernelScene;
  private readonly kernels: KernelAvatar;
  private programs: Lease<GlPrograms> | null = null;
  private draw: GlDraw | null = null;

  constructor(
    readonly avatar: Avatar,
    kernels: WebAssembly.Module,
  ) {
    this.instance = new Instance(avatar, NO_HOST, 0);
    this.level = this.instance.program;
    this.scene = new KernelScene(new WebAssembly.Instance(kernels));
    this.kernels = this.scene.add(ID, kernelProgram(avatar, this.level, avatar.relight !== null, true));
    this.scene.choose([ID]);
  }

  get values(): Instance["values"] {
    return this.instance.values;
  }

  write(buffer: string, floats: Float32Array): void {
    this.scene.heap.f32.set(floats, this.kernels.address(buffer) / 4);
  }

  async read(buffer: string): Promise<Float32Array> {
    const at = this.kernels.address(buffer) / 4;
    const bytes = this.avatar.program.buffers.get(buffer)?.bytes ?? 0;
    return this.scene.heap.f32.slice(at, at + bytes / 4);
  }

  async run(stage: string): Promise<void> {
    for (const passes of this.kernels.lists) {
      passes.uniforms.set(this.values);
      passes.write();
      passes.runStage(stage);
    }
  }

  async sort(): Promise<Uint32Array> {
    return this.order(this.scene.sorted());
  }

  async raster(order: Uint32Array, camera: Camera): Promise<Float32Array> {
    const words = this.scene.heap.u32;
    order.forEach((id, i) => (words[this.scene.pairsWord + 2 * i + 1] = id));
    const drawn = this.scene.gather(order.length);
    this.draw ??= this.drawing();
    const quads = new Float32Array(floatsOfQuads(drawn));
    quads.set(this.scene.quadFloats.subarray(0, FLOATS * drawn));
    this.draw.upload(quads, drawn);
    this.draw.accumulate(drawn, camera.width, camera.height);
    return this.draw.read();
  }

  dispose(): void {
    this.draw?.dispose();
    this.programs?.release();
  }

  private drawing(): GlDraw {
    const { gl, programs } = pageContext();
    this.programs = programs.take();
    return new GlDraw(gl, this.programs.value);
  }

  private order(drawn: number): Uint32Array {
    const words = this.scene.heap.u32;
    return Uint32Array.from({ length: drawn }, (_, i) => words[this.scene.pairsWord + 2 * i + 1] as number);
  }
}
