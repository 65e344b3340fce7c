// The meshes of rigs, posed on the page's own thread: they cast the shadows of avatars.

import type { Avatar } from "../avatar.js";
import type { Elements, Level } from "../pack/model.js";
import type { Pose } from "../pose/pose.js";
import type { KernelAvatar } from "../webgl2/kernel_scene.js";
import { KernelScene, Poser, copied, kernelModule, kernelProgram } from "./gl_scene.js";

const WORD = 4; // bytes
const MESH_ALONE: Level = { prefix: "", chunks: [], deform: [], view: [], shadow: [], light: [] };

/** The rigs of a scene. One instance of the kernels poses them all. */
export class Rigs {
  private count = 0;

  private constructor(private readonly scene: KernelScene) {}

  /** Throws AvatarError where WebAssembly is not to be had. */
  static async create(): Promise<Rigs> {
    return new Rigs(new KernelScene(new WebAssembly.Instance(await kernelModule())));
  }

  /** null: the avatar has no mesh. Throws AvatarError if there is no more memory. */
  add(avatar: Avatar): RigMesh | null {
    const corners = cornersOf(avatar);
    if (corners === null || corners.length === 0) return null;
    const id = this.count++;
    const kernels = this.scene.add(id, kernelProgram(avatar, MESH_ALONE, false, true));
    return new RigMesh(avatar, corners, this.scene, kernels, () => this.scene.remove(id));
  }
}

/** The mesh of one rig, in the frame of `Instance.place`: metres, moved by the pose. `update` allocates nothing. */
export class RigMesh {
  readonly triangles: Uint32Array<ArrayBuffer>; // [F, 3]
  readonly positions: Float32Array<ArrayBuffer>; // [V, 3]
  /** The corners of the box that holds all positions. */
  readonly low = new Float32Array(3);
  readonly high = new Float32Array(3);
  private readonly poser: Poser;
  private readonly rows = new Float64Array(12).fill(NaN); // place from avatar
  private freed = false;

  /** @internal `Rigs.add` makes them. */
  constructor(
    private readonly avatar: Avatar,
    corners: Elements,
    private readonly scene: KernelScene,
    private readonly kernels: KernelAvatar,
    private readonly free: () => void,
  ) {
    const count = corners.length / 3;
    this.triangles = Uint32Array.from(corners, (_, i) => corners[(i % 3) * count + Math.floor(i / 3)] as number);
    this.positions = new Float32Array(3 * (1 + this.triangles.reduce((last, vertex) => Math.max(last, vertex), 0)));
    this.poser = new Poser(avatar);
  }

  /** Takes a pose; returns whether positions have changed. `mirror`: x of the host's scene points the other way. */
  update(pose: Pose, mirror: boolean): boolean {
    if (this.freed) return false;
    const { poseFloats, worldFromAvatar } = this.poser.update(pose);
    const { heap } = this.scene;
    const first = Number.isNaN(this.rows[0]);
    const posed = copied(poseFloats, 0, heap.f32, this.kernels.address("Pose") / WORD, poseFloats.length) || first;
    if (posed) this.kernels.mesh.run();
    const moved = this.setRows(worldFromAvatar, (this.avatar.handedness === "left") !== mirror);
    if (posed || moved) this.place(heap.f32, this.kernels.address("Mesh") / WORD);
    return posed || moved;
  }

  /** The positions stay as they are. */
  dispose(): void {
    this.freed = true;
    this.free();
  }

  /** The pose moves first, then a mirror turns x around. Returns whether a number has changed. */
  private setRows(world: Float64Array, mirrored: boolean): boolean {
    let changed = false;
    for (let k = 0; k < 12; k++) {
      const value = (mirrored && k < 4 ? -1 : 1) * (world[k] as number);
      if (value !== this.rows[k]) changed = true;
      this.rows[k] = value;
    }
    return changed;
  }

  /** Positions, and their box, of the float4 of vertices from `mesh[at]` on. */
  private place(mesh: Float32Array, at: number): void {
    const { rows, positions, low, high } = this;
    for (let axis = 0; axis < 3; axis++) {
      const a = rows[4 * axis] as number, b = rows[4 * axis + 1] as number, c = rows[4 * axis + 2] as number;
      const d = rows[4 * axis + 3] as number;
      let least = Infinity, most = -Infinity;
      for (let i = axis, from = at; i < positions.length; i += 3, from += 4) {
        const value = a * (mesh[from] as number) + b * (mesh[from + 1] as number) + c * (mesh[from + 2] as number) + d;
        positions[i] = value;
        if (value < least) least = value;
        if (value > most) most = value;
      }
      low[axis] = least;
      high[axis] = most;
    }
  }
}

/** The corners [3, F] of an avatar's mesh; null: it has none. */
function cornersOf({ triangles, program }: Avatar): Elements | null {
  if (program.mesh.length === 0) return null;
  if (triangles !== null) return triangles;
  const bound = program.levels[0]?.deform.find(({ buffers }) => "SurfaceStatic" in buffers)?.buffers["SurfaceStatic"] ?? "";
  return program.buffers.get(bound)?.sections.find(({ name }) => name === "corners")?.elements ?? null;
}
