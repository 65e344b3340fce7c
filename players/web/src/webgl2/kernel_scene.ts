// Stages morph to sort in WebAssembly, for all avatars of a scene. It runs in a worker, and in Node for tests.

import type { Avatar } from "../avatar.js";
import { Due } from "../due.js";
import { FrameLayout } from "../frame.js";
import { contentOf } from "../pack/content.js";
import { bindMesh, type Buffer, type Level, type Pass } from "../pack/model.js";
import { Heap } from "./memory.js";
import { KernelPasses, type Kernels, type Placed } from "./kernel_passes.js";
import { SplatSort } from "./splat_sort.js";
import { copied } from "../uniforms.js";

const WORD = 4, PAIR = 8, QUAD = 48; // bytes: of a word, of (key, id), of a drawn instance

/** What the kernels need of an avatar at one level. It crosses into the worker once. */
export interface KernelProgram extends Level {
  readonly owner: string; // the avatar's name
  readonly buffers: readonly { readonly name: string; readonly bytes: number; readonly words: Uint32Array | null }[];
  readonly mesh: readonly Pass[]; // none if nothing reads the mesh
  readonly groups: number;
  readonly poseFloats: number;
}

/**
 * The buffers that the passes of a level bind, with their content. `lit`: with stages shadow and light. `mesh`: with
 * stages morph and skin in any case.
 */
export function kernelProgram(avatar: Avatar, level: Level, lit: boolean, mesh = false): KernelProgram {
  const { program } = avatar;
  const shadow = lit ? level.shadow : [], light = lit ? level.light : [];
  const morphed = mesh || program.readsMesh || bindMesh(shadow) ? program.mesh : [];
  const names = new Set([...morphed, ...level.deform, ...level.view, ...shadow, ...light].flatMap((one) => Object.values(one.buffers)));
  return {
    ...level,
    shadow,
    light,
    owner: avatar.name,
    buffers: [...names].map((name) => described(program.buffers.get(name) as Buffer)),
    mesh: morphed,
    groups: avatar.groups.length,
    poseFloats: program.poseFloats,
  };
}

function described(buffer: Buffer): KernelProgram["buffers"][number] {
  if (buffer.sections.length === 0) return { name: buffer.name, bytes: buffer.bytes, words: null };
  return { name: buffer.name, bytes: buffer.bytes, words: contentOf(buffer) };
}

/** One avatar in the kernels' memory. */
export class KernelAvatar {
  readonly layout: FrameLayout;
  readonly mesh: KernelPasses;
  readonly deform: KernelPasses;
  readonly view: KernelPasses;
  readonly shadow: KernelPasses;
  readonly light: KernelPasses;
  readonly values: { readonly floats: Float32Array };
  private readonly at = new Map<string, number>();
  private ran = false; // deform and view have run
  private readonly due: Due;

  constructor(
    private readonly heap: Heap,
    kernels: Kernels,
    readonly program: KernelProgram,
  ) {
    this.layout = new FrameLayout(program.groups);
    for (const { name, bytes, words } of program.buffers) {
      const at = heap.allocate(bytes, program.owner);
      if (words !== null) heap.u32.set(words, at / WORD);
      this.at.set(name, at);
    }
    const list = (passes: readonly Pass[]): KernelPasses =>
      new KernelPasses(heap, kernels, passes.map((one) => this.placed(one)), this.layout, program.owner);
    this.mesh = list(program.mesh);
    this.deform = list(program.deform);
    this.view = list(program.view);
    this.shadow = list(program.shadow);
    this.light = list(program.light);
    this.due = new Due(program, this.layout);
    this.values = { floats: new Float32Array(this.layout.size) };
  }

  get lists(): readonly KernelPasses[] {
    return [this.mesh, this.deform, this.shadow, this.view, this.light];
  }

  /** Floats that this avatar takes of the inputs of a frame. */
  get inputs(): number {
    return this.program.poseFloats + this.layout.size;
  }

  /** Takes the pose and the values of the frame from `inputs` at `first`. */
  write(inputs: Float32Array, first: number): void {
    const pose = this.at.get("Pose");
    const { poseFloats } = this.program;
    const floats = this.heap.f32;
    const { due, values } = this;
    if (pose !== undefined) due.posed = copied(inputs, first, floats, pose / WORD, poseFloats) || due.posed;
    copied(inputs, first + poseFloats, values.floats, 0, values.floats.length);
    if (this.ran && this.deform.uniforms.keepLasting()) this.deform.write();
    due.deformed = took(this.deform, values) || due.deformed;
    due.viewed = took(this.view, values) || due.viewed;
    if (values.floats[this.layout.lit] === 0) return;
    due.shaded = took(this.shadow, values) || due.shaded;
    due.viewed = took(this.light, values) || due.viewed;
  }

  /** Runs the passes whose inputs have changed since the last run; returns whether there were any. */
  run(): boolean {
    const { due } = this;
    due.decide(this.values.floats);
    if (due.mesh) this.mesh.run();
    if (due.deform) this.deform.run();
    if (due.shadow) this.shadow.run();
    if (due.view) this.view.run();
    if (due.light) this.light.run();
    this.ran = true;
    return due.view;
  }

  /** The address of a buffer of the program. */
  address(name: string): number {
    return this.at.get(name) as number;
  }

  dispose(): void {
    for (const passes of this.lists) passes.dispose();
    for (const at of this.at.values()) this.heap.release(at);
  }

  private placed(one: Pass): Placed {
    const buffers = Object.entries(one.buffers).map(([name, of]): [string, number] => [name, this.address(of)]);
    return { entry: one.entry, constants: one.constants, rows: one.rows, buffers: Object.fromEntries(buffers) };
  }
}

/** Gives passes the values of a frame; returns whether one has changed. */
function took(passes: KernelPasses, values: { readonly floats: Float32Array }): boolean {
  const changed = passes.uniforms.set(values);
  if (changed) passes.write();
  return changed;
}

/** Avatars that are sorted together. Its result is quads, back to front. */
export class KernelScene {
  readonly heap: Heap;
  private readonly kernels: Kernels;
  private readonly avatars = new Map<number, KernelAvatar>();
  private drawn: KernelAvatar[] = [];
  private keys: KernelPasses | null = null;
  private gathers: KernelPasses | null = null;
  private sort = new SplatSort(0);
  private pairs = 0; // addresses
  private quads = 0;
  private quadView: Float32Array | null = null; // made once, so that a frame makes none
  private capacity = 0; // splats
  private count = -1; // quads of the last run; -1: the choice is new
  private chunks = 0;
  private drawnWords: number[] = []; // constants of the gathers that count drawn splats

  constructor(instance: WebAssembly.Instance) {
    const { memory, __heap_base } = instance.exports as { memory: WebAssembly.Memory; __heap_base: WebAssembly.Global };
    this.heap = new Heap(memory, __heap_base.value as number);
    this.kernels = instance.exports as unknown as Kernels;
  }

  /** Takes an avatar under a number of the caller's. Throws AvatarError if there is no more memory. */
  add(id: number, program: KernelProgram): KernelAvatar {
    this.remove(id);
    const avatar = new KernelAvatar(this.heap, this.kernels, program);
    this.avatars.set(id, avatar);
    return avatar;
  }

  remove(id: number): void {
    const avatar = this.avatars.get(id);
    if (avatar === undefined) return;
    this.avatars.delete(id);
    this.choose([]);
    avatar.dispose();
  }

  /** What is drawn from now on, in the order of ids that splits ties of depth. */
  choose(ids: readonly number[]): void {
    this.forget();
    this.count = -1;
    this.drawn = ids.flatMap((id) => this.avatars.get(id) ?? []);
    const chunks = this.drawn.flatMap((avatar) =>
      avatar.program.chunks.map(({ count }, i) => ({
        count,
        projected: avatar.address(`${avatar.program.prefix}Projected.${i}`),
      })),
    );
    const count = chunks.reduce((sum, chunk) => sum + chunk.count, 0);
    this.pairs = this.heap.allocate(PAIR * count);
    this.quads = this.heap.allocate(QUAD * count);
    this.capacity = count;
    this.sort = new SplatSort(count);
    let first = 0;
    const keys: Placed[] = [];
    const gathers: Placed[] = [];
    for (const chunk of chunks) {
      const buffers = { Projected: chunk.projected, Pairs: this.pairs, Quads: this.quads };
      keys.push({ entry: "sort_keys", rows: chunk.count, buffers, constants: { count: chunk.count, first } });
      const constants = { count, begin: 0, piece_count: count, first, chunk_count: chunk.count, reverse: 1 };
      gathers.push({ entry: "raster_gather", rows: count, buffers, constants });
      first += chunk.count;
    }
    this.keys = new KernelPasses(this.heap, this.kernels, keys, null);
    const gather = (this.gathers = new KernelPasses(this.heap, this.kernels, gathers, null));
    this.chunks = gathers.length;
    this.drawnWords = gathers.flatMap(({ entry }, i) =>
      ["count", "piece_count"].map((name) => gather.uniforms.word(i, entry, name)),
    );
  }

  /** Splats of what is drawn. */
  get splats(): number {
    return this.capacity;
  }

  /** Floats of the inputs of a frame: of each drawn avatar its pose, then its values of the frame. */
  get inputs(): number {
    let floats = 0;
    for (let i = 0; i < this.drawn.length; i++) floats += (this.drawn[i] as KernelAvatar).inputs;
    return floats;
  }

  /** Runs the stages whose inputs have changed; returns the number of quads. */
  run(inputs: Float32Array): number {
    let first = 0;
    let changed = this.count < 0;
    for (let i = 0; i < this.drawn.length; i++) {
      const avatar = this.drawn[i] as KernelAvatar;
      avatar.write(inputs, first);
      changed = avatar.run() || changed;
      first += avatar.inputs;
    }
    if (changed) this.count = this.gather(this.sorted());
    return this.count;
  }

  /** Stage sort of what is projected: writes the order, front to back; returns how many splats are drawn. */
  sorted(): number {
    this.keys?.run();
    return this.sort.run(this.heap.u32, this.pairs / WORD);
  }

  /** Quads of the first `drawn` pairs, back to front; returns `drawn`. */
  gather(drawn: number): number {
    const { gathers } = this;
    if (gathers === null) return 0;
    const { words } = gathers.uniforms;
    for (let i = 0; i < this.drawnWords.length; i++) words[this.drawnWords[i] as number] = drawn;
    gathers.write();
    for (let i = 0; i < this.chunks; i++) gathers.runOne(i, drawn);
    return drawn;
  }

  /** Room for the quads of all splats; those of the last run come first. The view is valid until the next call. */
  get quadFloats(): Float32Array {
    const { buffer } = this.heap.f32;
    if (this.quadView === null || this.quadView.buffer !== buffer) {
      this.quadView = new Float32Array(buffer, this.quads, (QUAD / WORD) * this.capacity);
    }
    return this.quadView;
  }

  /** First word of the pairs (key, id): for conformance. */
  get pairsWord(): number {
    return this.pairs / WORD;
  }

  private forget(): void {
    this.keys?.dispose();
    this.gathers?.dispose();
    this.keys = this.gathers = null;
    if (this.pairs !== 0) this.heap.release(this.pairs);
    if (this.quads !== 0) this.heap.release(this.quads);
    this.pairs = this.quads = 0;
    this.quadView = null;
  }
}
