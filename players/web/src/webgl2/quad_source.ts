// Quads of instances, computed by WebAssembly kernels behind a port.

import type { Camera } from "../camera.js";
import { AvatarError } from "../errors.js";
import type { Instance, InstanceHost } from "../instance.js";
import { kernelProgram } from "./kernel_scene.js";
import type { FrameMessage, SceneAnswer, SceneMessage } from "./messages.js";

/** What takes the messages of a scene: in a worker, or on this thread. */
export interface QuadPort {
  onmessage: ((event: MessageEvent<SceneAnswer>) => void) | null;
  onerror: ((event: ErrorEvent) => void) | null;
  postMessage(message: SceneMessage, transfer?: Transferable[]): void;
  terminate(): void;
}

/** Somebody who waits for a frame, by its number. */
interface Waiter {
  readonly frame: number;
  readonly done: () => void;
}

/** Knows which instances there are, asks for their quads, and keeps the newest result. */
export class QuadSource implements InstanceHost {
  /** Resolves with a reason when no more quads will come. */
  readonly lost: Promise<string>;
  /** The newest quads, back to front: the first `count` of them. */
  quads = new Float32Array(0);
  count = 0;
  /** Pixels of the camera that the newest quads belong to. */
  width = 0;
  height = 0;
  /** Most splats that can be drawn; `add` refuses more. */
  most = Infinity;
  /** Called when new quads have come. */
  onQuads: () => void = () => undefined;
  private lose: (reason: string) => void = () => undefined;
  private readonly ids = new Map<Instance, number>();
  private readonly sent = new Map<Instance, { readonly level: number; readonly lit: boolean }>(); // what the kernels have
  private nextId = 1;
  private chosen = false; // the kernels know what is drawn
  private drawn: Instance[] = [];
  private busy = false;
  private waiting = false; // inputs of a newer frame are in `next`
  private next = new Float32Array(0);
  private asked = new Float32Array(0); // the inputs that were sent last
  private readonly message: FrameMessage = { kind: "frame", inputs: new Float32Array(0), quads: new Float32Array(0) };
  private readonly lent: ArrayBuffer[] = [];
  private readonly size = new Int32Array(4); // width and height: of the frame under way, of the next one
  private requested = 0; // frames: asked for, lent to the kernels, received
  private posted = 0;
  private received = 0;
  private readonly waiters: Waiter[] = [];

  constructor(private readonly port: QuadPort) {
    this.lost = new Promise((resolve) => (this.lose = resolve));
    port.onmessage = (event: MessageEvent<SceneAnswer>) => this.receive(event.data);
    port.onerror = (event) => this.lose(`the worker stopped: ${event.message}`);
  }

  add(instance: Instance): void {
    this.ids.set(instance, this.nextId++);
    try {
      this.send(instance);
    } catch (error) {
      this.ids.delete(instance);
      throw error;
    }
  }

  changed(instance: Instance): void {
    if (this.ids.has(instance)) this.send(instance);
  }

  remove(instance: Instance): void {
    const id = this.ids.get(instance);
    if (id === undefined) return;
    this.ids.delete(instance);
    this.sent.delete(instance);
    this.chosen = false;
    this.port.postMessage({ kind: "remove", id });
  }

  /** Asks for the quads of the instances as they are now. A frame that comes too early replaces one that waits. */
  frame(camera: Camera): void {
    this.write(camera);
    this.ask();
  }

  /** As `frame`, but asks for nothing where the last asked frame is the same. */
  frameIfChanged(camera: Camera): void {
    const known = this.chosen;
    this.write(camera);
    if (!known || !this.asks(camera)) this.ask();
  }

  /** The next `frameIfChanged` asks in any case. */
  forget(): void {
    this.asked = new Float32Array(0);
  }

  /** Resolves when the frame that was asked for last, or a newer one, is here. */
  finished(): Promise<void> {
    const frame = this.requested;
    if (this.received >= frame) return Promise.resolve();
    const finishedAt = (done: () => void): void => void this.waiters.push({ frame, done });
    return new Promise(finishedAt);
  }

  dispose(): void {
    this.port.terminate();
    this.onQuads = () => undefined;
    this.ids.clear();
    this.drawn = [];
    this.wake(Infinity);
  }

  private send(instance: Instance): void {
    this.chosen = false;
    const sent = this.sent.get(instance);
    const { avatar, level, canBeLit: lit } = instance;
    if (sent?.level === level && sent.lit === lit) return;
    this.checkSplats(instance);
    const program = kernelProgram(avatar, instance.program, lit);
    this.port.postMessage({ kind: "add", id: this.ids.get(instance) as number, program });
    this.sent.set(instance, { level, lit });
  }

  private checkSplats(added: Instance): void {
    let splats = 0;
    for (const { avatar, level } of this.ids.keys()) splats += avatar.levels[level]?.count ?? 0;
    if (splats > this.most) {
      throw new AvatarError(`the scene would have ${splats} splats; this browser can draw ${this.most}. Use a coarser level of detail.`, {
        owner: added.avatar.name,
        field: "WebGL2",
      });
    }
  }

  private choose(): void {
    this.chosen = true;
    this.drawn = [...this.ids.keys()].filter((instance) => instance.visible);
    const floats = this.drawn.reduce((sum, one) => sum + one.poseFloats.length + one.values.floats.length, 0);
    this.next = new Float32Array(floats);
    this.port.postMessage({ kind: "choose", ids: this.drawn.map((instance) => this.ids.get(instance) as number) });
  }

  /** Poses the instances and writes the inputs of the next frame. */
  private write(camera: Camera): void {
    if (!this.chosen) this.choose();
    let at = 0;
    for (let i = 0; i < this.drawn.length; i++) {
      const instance = this.drawn[i] as Instance;
      instance.update(camera);
      this.next.set(instance.poseFloats, at);
      this.next.set(instance.values.floats, at + instance.poseFloats.length);
      at += instance.poseFloats.length + instance.values.floats.length;
    }
    this.size[2] = camera.width;
    this.size[3] = camera.height;
  }

  /** Whether the frame that was sent last, or waits, is what `next` holds. */
  private asks(camera: Camera): boolean {
    const { asked, next, size } = this;
    if (this.waiting || asked.length !== next.length || size[0] !== camera.width || size[1] !== camera.height) return false;
    for (let i = 0; i < next.length; i++) {
      if (asked[i] !== next[i]) return false;
    }
    return true;
  }

  private ask(): void {
    this.waiting = true;
    this.requested++;
    if (!this.busy) this.post();
  }

  /** Lends the inputs of the newest frame to the kernels. */
  private post(): void {
    const { message, next, lent } = this;
    if (message.inputs.length !== next.length) message.inputs = new Float32Array(next.length);
    if (this.asked.length !== next.length) this.asked = new Float32Array(next.length);
    message.inputs.set(next);
    this.asked.set(next);
    this.size[0] = this.size[2] as number;
    this.size[1] = this.size[3] as number;
    lent[0] = message.inputs.buffer;
    lent[1] = message.quads.buffer;
    this.waiting = false;
    this.busy = true;
    this.posted = this.requested;
    this.port.postMessage(message, lent);
  }

  private receive(data: SceneAnswer): void {
    this.busy = false;
    if (data.kind === "failed") {
      this.lose(data.message);
      return;
    }
    this.message.inputs = data.inputs;
    this.message.quads = this.quads = data.quads;
    this.count = data.count;
    this.width = this.size[0] as number;
    this.height = this.size[1] as number;
    this.received = this.posted;
    this.onQuads();
    if (this.waiting) this.post();
    if (this.waiters.length > 0) this.wake(this.received);
  }

  /** Whoever waits for one of the first `frames` frames goes on. */
  private wake(frames: number): void {
    let kept = 0;
    for (let i = 0; i < this.waiters.length; i++) {
      const waiter = this.waiters[i] as Waiter;
      if (waiter.frame <= frames) waiter.done();
      else this.waiters[kept++] = waiter;
    }
    this.waiters.length = kept;
  }
}
