// Single stages on WebGPU, for conformance.

import type { Avatar } from "../avatar.js";
import type { Camera } from "../camera.js";
import type { StageRunner } from "../conform/stages.js";
import { Instance } from "../instance.js";
import type { Level } from "../pack/model.js";
import { Accumulator } from "./draw.js";
import { FLOAT_BLEND } from "./device.js";
import type { Pipelines } from "./pipelines.js";
import { readBuffer, readImage } from "./read.js";
import { Resident, StaticBuffers } from "./resident.js";
import { Sorted } from "./sorted.js";

const NOT_DRAWN = 0xffffffff;
const NO_HOST = { changed: () => undefined, remove: () => undefined };

/** One avatar at its finest level, with the pipelines of a renderer. */
export class WebGpuStages implements StageRunner {
  readonly level: Level;
  private readonly instance: Instance;
  private readonly shared: StaticBuffers;
  private readonly resident: Resident;
  private readonly sorted: Sorted;
  private readonly accumulator: Accumulator;

  private readonly device: GPUDevice;

  constructor(
    pipelines: Pipelines,
    readonly avatar: Avatar,
  ) {
    const device = (this.device = pipelines.device);
    this.instance = new Instance(avatar, NO_HOST, 0);
    if (avatar.relight !== null) this.instance.lit();
    this.level = this.instance.program;
    this.shared = new StaticBuffers(device, avatar);
    this.resident = new Resident(pipelines, this.shared, this.instance);
    const chunks = this.level.chunks.map(({ count }, i) => ({ projected: this.resident.projected[i] as GPUBuffer, count }));
    this.sorted = new Sorted(pipelines, chunks);
    this.accumulator = new Accumulator(pipelines, device.features.has(FLOAT_BLEND) ? "rgba32float" : "rgba16float");
  }

  get values(): Instance["values"] {
    return this.instance.values;
  }

  write(buffer: string, floats: Float32Array): void {
    this.device.queue.writeBuffer(this.resident.buffer(buffer), 0, floats as Float32Array<ArrayBuffer>);
  }

  async read(buffer: string): Promise<Float32Array> {
    return new Float32Array(await readBuffer(this.device, this.resident.buffer(buffer)));
  }

  async run(stage: string): Promise<void> {
    for (const passes of this.resident.lists) passes.set(this.values);
    await this.compute((pass) => {
      for (const passes of this.resident.lists) passes.encodeStage(pass, stage);
    });
  }

  async sort(): Promise<Uint32Array> {
    await this.compute((pass) => this.sorted.encodeSort(pass));
    const pairs = new Uint32Array(await readBuffer(this.device, this.sorted.pairs));
    const order: number[] = [];
    for (let i = 0; i < this.sorted.count; i++) {
      if (pairs[2 * i] !== NOT_DRAWN) order.push(pairs[2 * i + 1] as number);
    }
    return Uint32Array.from(order);
  }

  async raster(order: Uint32Array, camera: Camera): Promise<Float32Array> {
    const { count } = this.sorted;
    const pairs = new Uint32Array(2 * count);
    const drawn = new Set(order);
    const rest = Array.from({ length: count }, (_, i) => i).filter((id) => !drawn.has(id));
    [...order, ...rest].forEach((id, i) => {
      pairs[2 * i] = i < order.length ? 0 : NOT_DRAWN;
      pairs[2 * i + 1] = id;
    });
    this.device.queue.writeBuffer(this.sorted.pairs, 0, pairs);
    await this.compute((pass) => this.sorted.encodeGather(pass));
    const encoder = this.device.createCommandEncoder();
    this.accumulator.draw(encoder, this.sorted.quads, count, camera.width, camera.height, null);
    this.device.queue.submit([encoder.finish()]);
    return readImage(this.device, this.accumulator.image as GPUTexture);
  }

  dispose(): void {
    this.sorted.dispose();
    this.accumulator.dispose();
    this.resident.dispose();
    this.shared.dispose();
  }

  private async compute(encode: (pass: GPUComputePassEncoder) => void): Promise<void> {
    const encoder = this.device.createCommandEncoder();
    const pass = encoder.beginComputePass();
    encode(pass);
    pass.end();
    this.device.queue.submit([encoder.finish()]);
    await this.device.queue.onSubmittedWorkDone();
  }
}
