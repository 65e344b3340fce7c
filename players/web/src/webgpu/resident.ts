// What an avatar holds on the GPU: static buffers, shared by its instances, and buffers of each instance.

import type { Avatar } from "../avatar.js";
import type { Instance } from "../instance.js";
import { contentOf } from "../pack/content.js";
import type { Buffer, Level, Pass } from "../pack/model.js";
import { Due } from "../due.js";
import { copied } from "../uniforms.js";
import { checkBufferSize } from "./device.js";
import { PassList, groupsOf, type Bound } from "./passes.js";
import type { Pipelines } from "./pipelines.js";

const STORAGE = 0x80, COPY_DST = 0x8, COPY_SRC = 0x4; // GPUBufferUsage
const LEAST_BYTES = 16; // of a binding: kernels declare arrays of float4

/** Static buffers of one avatar, uploaded when a pass first binds them. */
export class StaticBuffers {
  users = 0;
  private readonly buffers = new Map<string, GPUBuffer>();

  constructor(
    private readonly device: GPUDevice,
    readonly avatar: Avatar,
  ) {}

  get(described: Buffer): GPUBuffer {
    let buffer = this.buffers.get(described.name);
    if (buffer === undefined) {
      buffer = makeBuffer(this.device, this.avatar, described);
      new Uint32Array(buffer.getMappedRange()).set(contentOf(described));
      buffer.unmap();
      this.buffers.set(described.name, buffer);
    }
    return buffer;
  }

  dispose(): void {
    for (const buffer of this.buffers.values()) buffer.destroy();
  }
}

/** An instance at one level: its own buffers and its passes. */
export class Resident {
  readonly level: Level;
  readonly mesh: PassList; // stages morph and skin
  readonly deform: PassList;
  readonly view: PassList;
  readonly shadow: PassList; // empty where it cannot be lit
  readonly light: PassList;
  readonly lit: boolean; // stages shadow and light are there
  readonly projected: readonly GPUBuffer[]; // by chunk
  private readonly own = new Map<string, GPUBuffer>();
  private readonly lastPose: Float32Array<ArrayBuffer>; // what buffer Pose holds
  private ran = false; // deform and view have been encoded
  private readonly due: Due;

  /** Throws AvatarError where a buffer exceeds a limit of the GPU. */
  constructor(
    private readonly pipelines: Pipelines,
    private readonly shared: StaticBuffers,
    readonly instance: Instance,
  ) {
    const { program } = instance.avatar;
    const level = instance.program;
    this.level = level;
    this.lastPose = new Float32Array(program.poseFloats); // zeros, as a new buffer
    this.lit = instance.canBeLit;
    const { layout } = instance.values;
    this.due = new Due(level, layout);
    const list = (passes: readonly Pass[]): PassList => new PassList(pipelines, this.bound(passes), layout);
    try {
      this.mesh = list(program.mesh);
      this.deform = list(level.deform);
      this.view = list(level.view);
      this.shadow = list(this.lit ? level.shadow : []);
      this.light = list(this.lit ? level.light : []);
      this.projected = level.chunks.map((_, i) => this.buffer(`${level.prefix}Projected.${i}`));
    } catch (error) {
      this.dispose();
      throw error;
    }
  }

  get lists(): readonly PassList[] {
    return [this.mesh, this.deform, this.shadow, this.view, this.light];
  }

  /** Uploads what has changed of the pose and of the values of the frame. */
  write(): void {
    const { due } = this;
    const { poseFloats, values } = this.instance;
    const pose = this.own.get("Pose");
    if (pose !== undefined && copied(poseFloats, 0, this.lastPose, 0, poseFloats.length)) {
      this.pipelines.device.queue.writeBuffer(pose, 0, this.lastPose);
      due.posed = true;
    }
    if (this.ran) this.deform.keepLasting();
    due.deformed = this.deform.set(values) || due.deformed;
    due.viewed = this.view.set(values) || due.viewed;
    if (values.floats[values.layout.lit] === 0) return;
    due.shaded = this.shadow.set(values) || due.shaded;
    due.viewed = this.light.set(values) || due.viewed;
  }

  /** Encodes the passes whose inputs have changed since the last call; returns whether there were any. */
  encode(pass: GPUComputePassEncoder): boolean {
    const { due } = this;
    due.decide(this.instance.values.floats);
    if (due.mesh) this.mesh.encode(pass);
    if (due.deform) this.deform.encode(pass);
    if (due.shadow) this.shadow.encode(pass);
    if (due.view) this.view.encode(pass);
    if (due.light) this.light.encode(pass);
    this.ran = true;
    return due.view;
  }

  /** A buffer of the program by its name: for conformance. */
  buffer(name: string): GPUBuffer {
    const described = this.instance.avatar.program.buffers.get(name) as Buffer;
    if (described.sections.length > 0) return this.shared.get(described);
    let buffer = this.own.get(name);
    if (buffer === undefined) {
      buffer = makeBuffer(this.pipelines.device, this.instance.avatar, described);
      buffer.unmap();
      this.own.set(name, buffer);
    }
    return buffer;
  }

  dispose(): void {
    for (const passes of this.lists) passes?.dispose();
    for (const buffer of this.own.values()) buffer.destroy();
    this.own.clear();
  }

  private bound(passes: readonly Pass[]): Bound[] {
    return passes.map((one) => ({
      entry: one.entry,
      constants: one.constants,
      groups: groupsOf(one.rows),
      buffers: Object.fromEntries(Object.entries(one.buffers).map(([name, of]) => [name, this.buffer(of)])),
    }));
  }
}

/** A mapped buffer. */
function makeBuffer(device: GPUDevice, avatar: Avatar, described: Buffer): GPUBuffer {
  checkBufferSize(device, described.bytes, `buffer ${described.name}`, avatar.name);
  const size = Math.max(Math.ceil(described.bytes / 16) * 16, LEAST_BYTES);
  const usage = STORAGE | COPY_DST | COPY_SRC;
  return device.createBuffer({ label: described.name, size, usage, mappedAtCreation: true });
}
