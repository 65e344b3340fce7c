// The player: one canvas, several avatars, one image.

import type { Avatar } from "./avatar.js";
import type { Camera } from "./camera.js";
import { AvatarError } from "./errors.js";
import { checkRelit, Instance } from "./instance.js";
import type { Light } from "./light/light.js";
import type { Background, Renderer } from "./renderer.js";
import { DEVICE } from "./webgpu/device.js";

export type Canvas = HTMLCanvasElement | OffscreenCanvas;

/** Options of `Player.create`. */
export interface PlayerOptions {
  /** The default is WebGPU where the browser has it, else WebGL2. */
  readonly backend?: "webgpu" | "webgl2";
}

/** Plays avatars on a canvas. The players of a page share one GPU device, or one WebGL2 context and one worker. */
export class Player {
  /** Avatars in the order in which they were added; ties of depth are drawn in this order. */
  readonly instances: Instance[] = [];

  private disposed = false;
  private said: Light | null = null;

  private constructor(
    /** null: nothing is shown, and `readPixels` gives the image. */
    readonly canvas: Canvas | null,
    /** @internal */
    readonly renderer: Renderer,
  ) {}

  /** Throws AvatarError where the browser has neither WebGPU nor WebGL2, or not the one that was asked for. */
  static async create(canvas: Canvas | null, options: PlayerOptions = {}): Promise<Player> {
    return new Player(canvas, await makeRenderer(canvas, options.backend));
  }

  /** What draws: "webgpu" or "webgl2". */
  get backend(): "webgpu" | "webgl2" {
    return this.renderer.kind;
  }

  /** Resolves with a reason when the GPU is lost. Nothing is drawn afterwards; make another player. */
  get lost(): Promise<string> {
    return this.renderer.lost;
  }

  /** Splats of the last frame. */
  get splats(): number {
    return this.renderer.splats;
  }

  /** Images that were drawn so far. On WebGL2 there may be fewer than calls of `frame`. */
  get images(): number {
    return this.renderer.images;
  }

  /**
   * The light of the scene, which falls on all avatars, also on those that are added later; null: all are shown as
   * trained. Throws AvatarError for a light that cannot be, and for an avatar that was not packed with `--relight`.
   */
  get light(): Light | null {
    return this.said;
  }

  set light(light: Light | null) {
    const { instances } = this;
    for (let i = 0; light !== null && i < instances.length; i++) checkRelit((instances[i] as Instance).avatar);
    for (let i = 0; i < instances.length; i++) (instances[i] as Instance).light = light;
    this.said = light;
  }

  /**
   * Puts an avatar into the scene. Throws AvatarError where it exceeds a limit of the GPU, has no such level or cannot
   * have the light of the scene, and after `dispose`.
   */
  add(avatar: Avatar, options: { level?: number } = {}): Instance {
    this.checkAlive();
    const host = { changed: (one: Instance) => this.renderer.changed(one), remove: (one: Instance) => this.remove(one) };
    const instance = new Instance(avatar, host, options.level ?? 0);
    if (this.said !== null) instance.light = this.said;
    this.renderer.add(instance);
    this.instances.push(instance);
    return instance;
  }

  /**
   * Draws the instances as they are posed now. The canvas takes the camera's size. On WebGL2 the image appears when the
   * worker has computed it; a frame that comes too early replaces one that waits. Throws AvatarError after `dispose`.
   */
  frame(camera: Camera, background: Background = null): void {
    this.checkAlive();
    this.renderer.frame(camera, background);
  }

  /** Resolves when the frame that was asked for last, or a newer one, is on the canvas. */
  finished(): Promise<void> {
    return this.renderer.finished();
  }

  /** The last frame without its background: premultiplied, display-referred [H, W, 4], first row on top. */
  readPixels(): Promise<Float32Array> {
    return this.renderer.readPixels();
  }

  /** Frees the GPU's memory; the last player of a page ends the device. The canvas can serve another player of the same backend. */
  dispose(): void {
    if (this.disposed) return;
    this.disposed = true;
    this.instances.length = 0;
    this.renderer.dispose();
  }

  private checkAlive(): void {
    if (this.disposed) throw new AvatarError("this player was disposed of; make another with Player.create");
  }

  private remove(instance: Instance): void {
    const at = this.instances.indexOf(instance);
    if (at >= 0) this.instances.splice(at, 1);
    this.renderer.remove(instance);
  }
}

/** null where this browser has no WebGPU. */
async function startWebGpu(canvas: Canvas | null): Promise<Renderer | null> {
  const lease = DEVICE.take();
  try {
    const device = await lease.value;
    if (device !== null) {
      const { WebGpuRenderer } = await import("./webgpu/renderer.js");
      const context = (canvas?.getContext("webgpu") ?? null) as GPUCanvasContext | null;
      if (canvas !== null && context === null) throw new AvatarError("the canvas has another context already", { field: "WebGPU" });
      return new WebGpuRenderer(device, context, lease.release);
    }
  } catch (error) {
    lease.release();
    throw error;
  }
  lease.release();
  return null;
}

async function makeRenderer(canvas: Canvas | null, backend?: string): Promise<Renderer> {
  if (backend !== "webgl2") {
    const renderer = await startWebGpu(canvas);
    if (renderer !== null) return renderer;
    if (backend === "webgpu") throw new AvatarError("this browser has no WebGPU here", { field: "WebGPU" });
  }
  const { startWebGl2 } = await import("./webgl2/start.js");
  return startWebGl2(canvas);
}
