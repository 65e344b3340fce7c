// What the adapters of all engines have in common.

import type { Avatar } from "../avatar.js";
import { AvatarError } from "../errors.js";
import type { Instance } from "../instance.js";
import { ALPHA_MAX } from "../made/constants.js";
import type { SceneLights } from "./lights.js";

/** Options of `AvatarScene.create`. */
export interface AvatarSceneOptions {
  /**
   * On WebGL2, pictures wait for the avatars: what is drawn fits the camera and the pose exactly, and one scene can be
   * drawn from several cameras. The default false lets a worker compute: a picture shows its newest finished result,
   * usually one frame old. On WebGPU pictures always fit.
   */
  readonly synchronous?: boolean;
  /** The default true lets the lights of the scene fall on avatars that were packed with `--relight`. */
  readonly lights?: boolean;
  /**
   * Depth is written where the alpha of a splat reaches this, for what is drawn later: above 0, at most 0.99, which is
   * the most that a splat has. 0.1 closes most avatars; larger values leave holes. By default none is written.
   */
  readonly depthAlpha?: number;
  /**
   * Avatars cast shadows onto the scene: each brings the mesh of its rig, which only shadow maps see. One without a mesh
   * casts none. The default is false.
   */
  readonly shadows?: boolean;
}

/** Option `depthAlpha`; null: no depth is written. Throws AvatarError for a bad value. */
export function depthAlphaOf({ depthAlpha }: AvatarSceneOptions): number | null {
  if (depthAlpha === undefined) return null;
  if (typeof depthAlpha === "number" && depthAlpha > 0 && depthAlpha <= ALPHA_MAX) return depthAlpha;
  throw new AvatarError(`is ${depthAlpha}; give a number above 0, at most ${ALPHA_MAX}`, { owner: "AvatarScene", field: "depthAlpha" });
}

/** Avatars on the GPU of an engine. `Seen` is the engine's camera, or what has one. */
export interface AvatarHost<Seen> {
  /** Resolves with a reason when no more avatars can be drawn. */
  readonly lost: Promise<string>;
  /** Throws AvatarError where the avatar exceeds a limit of the GPU, or has no such level. */
  add(avatar: Avatar, level: number): Instance;
  /** Draws what a camera sees into what the engine draws into now. */
  draw(seen: Seen): void;
  /** Resolves when all that the last picture asked for is computed. */
  finished(): Promise<void>;
  dispose(): void;
}

/** The avatars of one scene: an engine's node and an instance each, and what draws them. */
export class Crowd<Node extends object, Seen> {
  private readonly nodes: Node[] = [];
  private readonly instances: Instance[] = [];

  /**
   * `update` writes where a node is and whether it is shown into its instance, before each picture; `collect` the lights
   * of the scene, where an avatar can have them. `lights`: null: all avatars are as trained.
   */
  constructor(
    private host: AvatarHost<Seen> | null,
    private readonly update: (node: Node, instance: Instance, seen: Seen) => void,
    private readonly lights: SceneLights | null,
    private readonly collect: (lights: SceneLights, seen: Seen) => void,
  ) {}

  /** Throws AvatarError after `dispose`. */
  get lost(): Promise<string> {
    return this.made.lost;
  }

  /** Throws AvatarError where the avatar exceeds a limit of the GPU, has no such level, and after `dispose`. */
  add(avatar: Avatar, level: number, node: (instance: Instance) => Node): Node {
    const instance = this.made.add(avatar, level);
    try {
      const made = node(instance);
      this.nodes.push(made);
      this.instances.push(instance);
      return made;
    } catch (error) {
      instance.dispose();
      throw error;
    }
  }

  /** Frees what a node holds on the GPU. */
  remove(node: Node): void {
    const at = this.nodes.indexOf(node);
    if (at < 0) return;
    this.nodes.splice(at, 1);
    this.instances.splice(at, 1)[0]?.dispose();
  }

  /** Calls `run` for each node. */
  each(run: (node: Node) => void): void {
    for (let i = 0; i < this.nodes.length; i++) run(this.nodes[i] as Node);
  }

  draw(seen: Seen): void {
    let collected = false;
    for (let i = 0; i < this.nodes.length; i++) {
      const instance = this.instances[i] as Instance;
      this.update(this.nodes[i] as Node, instance, seen);
      if (this.lights === null || instance.avatar.relight === null || !instance.visible) continue;
      if (!collected) {
        this.lights.begin();
        this.collect(this.lights, seen);
      }
      collected = true;
      this.lights.shineOn(instance);
    }
    this.host?.draw(seen);
  }

  finished(): Promise<void> {
    return this.host?.finished() ?? Promise.resolve();
  }

  /** `end` disposes of a node, which calls `remove`. */
  dispose(end: (node: Node) => void): void {
    for (let node = this.nodes[0]; node !== undefined; node = this.nodes[0]) end(node);
    this.host?.dispose();
    this.host = null;
  }

  private get made(): AvatarHost<Seen> {
    if (this.host === null) throw new AvatarError("was disposed; create another", { owner: "AvatarScene" });
    return this.host;
  }
}
