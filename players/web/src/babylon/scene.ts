// Avatars as nodes of a Babylon.js scene.

import { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import type { Observer } from "@babylonjs/core/Misc/observable.js";
import type { Scene } from "@babylonjs/core/scene.js";
import type { Avatar } from "../avatar.js";
import { madeOf, type DrawingHost, type AvatarSceneOptions } from "../engine/host.js";
import { setWorld } from "../engine/view.js";
import type { Instance } from "../instance.js";
import type { Pose } from "../pose/pose.js";
import { hostOf } from "./host.js";

/** An avatar in the scene. Its transform may be any, and any node may be its parent. */
export class AvatarNode extends TransformNode {
  /** @internal `AvatarScene.add` makes them. */
  constructor(
    readonly instance: Instance,
    scene: Scene,
    private readonly forget: (one: AvatarNode) => void,
  ) {
    super(instance.avatar.name, scene);
  }

  /** Expressions, joints and the movement of the whole avatar; set it before a picture. */
  get pose(): Pose {
    return this.instance.pose;
  }

  /** Level of detail, 0 the finest. Throws AvatarError if there is no such level. */
  get level(): number {
    return this.instance.level;
  }

  set level(level: number) {
    this.instance.level = level;
  }

  /** Hides the avatar, as `setEnabled(false)`. */
  get visible(): boolean {
    return this.isEnabled(false);
  }

  set visible(visible: boolean) {
    this.setEnabled(visible);
  }

  /** Takes the avatar out of the scene and frees what it holds on the GPU. */
  override dispose(doNotRecurse?: boolean, disposeMaterialAndTextures?: boolean): void {
    if (this.isDisposed()) return;
    this.forget(this);
    this.instance.dispose();
    super.dispose(doNotRecurse, disposeMaterialAndTextures);
  }
}

/** All avatars of a scene, sorted together. */
export class AvatarScene {
  /** Called when there is a newer picture than the one shown: for pages that draw on demand only. */
  onUpdate: (() => void) | null = null;
  private readonly heads: AvatarNode[] = [];
  private readonly observers: (Observer<Scene> | null)[];

  private constructor(
    readonly scene: Scene,
    private host: DrawingHost<[]> | null,
  ) {
    this.observers = [
      scene.onAfterDrawPhaseObservable.add(() => this.draw()),
      scene.onDisposeObservable.add(() => this.dispose()),
    ];
  }

  /** Throws AvatarError where the engine of the scene cannot draw avatars. */
  static async create(scene: Scene, options: AvatarSceneOptions = {}): Promise<AvatarScene> {
    let made: AvatarScene | null = null;
    const host = await hostOf(scene, options.synchronous ?? false, () => made?.onUpdate?.());
    return (made = new AvatarScene(scene, host));
  }

  /** Resolves with a reason when no more avatars can be drawn. */
  get lost(): Promise<string> {
    return this.made.lost;
  }

  /** Puts an avatar into the scene. Throws AvatarError where it exceeds a limit of the GPU, or has no such level. */
  add(avatar: Avatar, options: { readonly level?: number } = {}): AvatarNode {
    const forget = (one: AvatarNode): void => void this.heads.splice(this.heads.indexOf(one), 1);
    const head = new AvatarNode(this.made.add(avatar, options.level ?? 0), this.scene, forget);
    this.heads.push(head);
    return head;
  }

  /** Resolves when all that the last picture asked for is computed. On WebGL2, the next picture shows it. */
  finished(): Promise<void> {
    return this.host?.finished() ?? Promise.resolve();
  }

  /** Frees everything on the GPU. The scene goes on. */
  dispose(): void {
    for (const observer of this.observers) observer?.remove();
    for (const head of [...this.heads]) head.dispose();
    this.host?.dispose();
    this.host = null;
  }

  private get made(): DrawingHost<[]> {
    return madeOf(this.host);
  }

  private draw(): void {
    for (let i = 0; i < this.heads.length; i++) {
      const head = this.heads[i] as AvatarNode;
      const { instance } = head;
      instance.visible = head.isEnabled();
      setWorld(instance.world, head.getWorldMatrix().m, !this.scene.useRightHandedSystem);
    }
    this.host?.draw();
  }
}
