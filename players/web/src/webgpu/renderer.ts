// The WebGPU renderer: all stages after `joints` on the GPU.

import type { Camera } from "../camera.js";
import type { Instance } from "../instance.js";
import type { Background, Renderer } from "../renderer.js";
import { Accumulator, type Target } from "./draw.js";
import { FLOAT_BLEND } from "./device.js";
import { pipelinesOf, type Pipelines } from "./pipelines.js";
import { readImage } from "./read.js";
import { Resident, StaticBuffers } from "./resident.js";
import { Sorted } from "./sorted.js";

/** Draws instances with the device of the page or of an engine. */
export class WebGpuRenderer implements Renderer {
  readonly kind = "webgpu";
  readonly lost: Promise<string>;
  private readonly accumulator: Accumulator;
  private readonly residents = new Map<Instance, Resident>();
  private readonly shared = new Map<unknown, StaticBuffers>(); // by avatar
  /** @internal */
  sorted: Sorted | null = null; // null: to be made again
  private drawn: Resident[] = [];
  private readonly onCanvas: Target;
  private readonly commands: GPUCommandBuffer[] = [];

  /** @internal */
  readonly pipelines: Pipelines;

  /** `context` is null where an engine gives the targets, or nothing is shown. `release` is called when it is disposed of. */
  constructor(
    private readonly device: GPUDevice,
    private readonly context: GPUCanvasContext | null,
    private readonly release: () => void = () => undefined,
  ) {
    this.pipelines = pipelinesOf(device);
    this.lost = device.lost.then((info) => info.message || "the GPU device was lost");
    this.accumulator = new Accumulator(this.pipelines, device.features.has(FLOAT_BLEND) ? "rgba32float" : "rgba16float");
    const format = context === null ? "bgra8unorm" : navigator.gpu.getPreferredCanvasFormat();
    context?.configure({ device, format, alphaMode: "premultiplied" });
    const view = undefined as never; // of each frame
    this.onCanvas = { view, resolve: null, samples: 1, format, depth: null, background: null, keep: false, linear: false, part: null };
  }

  images = 0;

  get splats(): number {
    return this.sorted?.count ?? 0;
  }

  add(instance: Instance): void {
    let shared = this.shared.get(instance.avatar);
    if (shared === undefined) this.shared.set(instance.avatar, (shared = new StaticBuffers(this.device, instance.avatar)));
    shared.users++;
    try {
      this.residents.set(instance, new Resident(this.pipelines, shared, instance));
      this.forget();
      this.rebuild();
    } catch (error) {
      this.free(instance, shared);
      throw error;
    }
  }

  changed(instance: Instance): void {
    const resident = this.residents.get(instance);
    const shared = this.shared.get(instance.avatar);
    if (resident === undefined || shared === undefined) return;
    if (instance.program !== resident.level || instance.canBeLit !== resident.lit) {
      this.residents.set(instance, new Resident(this.pipelines, shared, instance));
      resident.dispose();
    }
    this.forget();
  }

  remove(instance: Instance): void {
    const shared = this.shared.get(instance.avatar);
    if (shared === undefined || !this.residents.has(instance)) return;
    this.free(instance, shared);
  }

  frame(camera: Camera, background: Background): void {
    if (this.context === null) {
      this.frameInto(camera, null);
      return;
    }
    const { canvas } = this.context;
    if (canvas.width !== camera.width) canvas.width = camera.width;
    if (canvas.height !== camera.height) canvas.height = camera.height;
    this.onCanvas.view = this.context.getCurrentTexture().createView();
    this.onCanvas.background = background;
    this.frameInto(camera, this.onCanvas);
  }

  /** Draws one frame onto a target of the camera's size; null: only into the image that `readPixels` reads. */
  frameInto(camera: Camera, target: Target | null): void {
    this.rebuild();
    const sorted = this.sorted as Sorted;
    const encoder = this.device.createCommandEncoder();
    const pass = encoder.beginComputePass();
    let changed = !sorted.encoded;
    for (let i = 0; i < this.drawn.length; i++) {
      const resident = this.drawn[i] as Resident;
      resident.instance.update(camera);
      resident.write();
      changed = resident.encode(pass) || changed;
    }
    if (changed) sorted.encode(pass);
    pass.end();
    this.accumulator.draw(encoder, sorted.quads, sorted.count, camera.width, camera.height, target?.depth ?? null);
    if (target !== null) this.accumulator.onto(encoder, target);
    this.commands[0] = encoder.finish();
    this.device.queue.submit(this.commands);
    this.images++;
  }

  finished(): Promise<void> {
    return this.device.queue.onSubmittedWorkDone().then(() => undefined);
  }

  async readPixels(): Promise<Float32Array> {
    const { image } = this.accumulator;
    return image === null ? new Float32Array(0) : readImage(this.device, image);
  }

  dispose(): void {
    for (const instance of [...this.residents.keys()]) this.remove(instance);
    this.forget();
    this.accumulator.dispose();
    this.context?.unconfigure();
    this.release();
  }

  private free(instance: Instance, shared: StaticBuffers): void {
    this.residents.get(instance)?.dispose();
    this.residents.delete(instance);
    if (--shared.users === 0) {
      shared.dispose();
      this.shared.delete(instance.avatar);
    }
    this.forget();
  }

  private forget(): void {
    this.sorted?.dispose();
    this.sorted = null;
  }

  /** The scene of what is visible now. */
  private rebuild(): void {
    if (this.sorted !== null) return;
    this.drawn = [...this.residents.values()].filter(({ instance }) => instance.visible);
    const chunks = this.drawn.flatMap((resident) =>
      resident.projected.map((projected, i) => ({ projected, count: resident.level.chunks[i]?.count ?? 0 })),
    );
    this.sorted = new Sorted(this.pipelines, chunks);
  }
}
