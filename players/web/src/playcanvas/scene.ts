// Avatars as nodes of a PlayCanvas scene.

import { GraphNode, LAYERID_WORLD, type AppBase, type CameraComponent, type EventHandle, type Layer } from "playcanvas";
import type { Avatar } from "../avatar.js";
import { madeOf, type DrawingHost, type AvatarSceneOptions as SharedOptions } from "../engine/host.js";
import { setWorld } from "../engine/view.js";
import type { Instance } from "../instance.js";
import type { Pose } from "../pose/pose.js";
import { hostOf } from "./host.js";

/** Options of `AvatarScene.create`. */
export interface AvatarSceneOptions extends SharedOptions {
  /** The layer after whose transparent meshes avatars are drawn. The default is World. */
  readonly layer?: number;
}

/** An avatar in the scene. Its transform may be any, and any entity may be its parent. */
export class AvatarNode extends GraphNode {
  /** @internal `AvatarScene.add` makes them. */
  constructor(
    readonly instance: Instance,
    private readonly forget: (one: AvatarNode) => void,
  ) {
    super(instance.avatar.name);
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

  /** Hides the avatar, as `enabled`. */
  get visible(): boolean {
    return this.enabled;
  }

  set visible(visible: boolean) {
    this.enabled = visible;
  }

  /** Takes the avatar out of the scene and frees what it holds on the GPU. */
  dispose(): void {
    this.destroy();
  }

  /** As `dispose`. */
  override destroy(): void {
    this.forget(this);
    this.instance.dispose();
    super.destroy();
  }
}

/** All avatars of an application, sorted together. */
export class AvatarScene {
  /** Called when there is a newer picture than the one shown: for pages that draw on demand only. */
  onUpdate: (() => void) | null = null;
  private readonly heads: AvatarNode[] = [];
  private readonly handles: EventHandle[];

  private constructor(
    readonly app: AppBase,
    private host: DrawingHost<[CameraComponent]> | null,
    private readonly layer: number,
  ) {
    this.handles = [
      app.scene.on("postrender:layer", (camera: CameraComponent, layer: Layer, transparent: boolean) => {
        if (transparent && layer.id === this.layer) this.draw(camera);
      }),
      app.on("destroy", () => this.dispose()),
    ];
  }

  /** Throws AvatarError where the graphics device of the application cannot draw avatars. */
  static async create(app: AppBase, options: AvatarSceneOptions = {}): Promise<AvatarScene> {
    let made: AvatarScene | null = null;
    const layer = options.layer ?? LAYERID_WORLD;
    const host = await hostOf(app, layer, options.synchronous ?? false, () => made?.onUpdate?.());
    return (made = new AvatarScene(app, host, layer));
  }

  /** Resolves with a reason when no more avatars can be drawn. */
  get lost(): Promise<string> {
    return this.made.lost;
  }

  /** Puts an avatar under the root. Throws AvatarError where it exceeds a limit of the GPU, or has no such level. */
  add(avatar: Avatar, options: { readonly level?: number } = {}): AvatarNode {
    const head = new AvatarNode(this.made.add(avatar, options.level ?? 0), (one) => this.forget(one));
    this.heads.push(head);
    this.app.root.addChild(head);
    return head;
  }

  /** Resolves when all that the last picture asked for is computed. On WebGL2, the next picture shows it. */
  finished(): Promise<void> {
    return this.host?.finished() ?? Promise.resolve();
  }

  /** Frees everything on the GPU. The application goes on. */
  dispose(): void {
    for (const handle of this.handles) handle.off();
    for (const head of [...this.heads]) head.dispose();
    this.host?.dispose();
    this.host = null;
  }

  private get made(): DrawingHost<[CameraComponent]> {
    return madeOf(this.host);
  }

  private forget(head: AvatarNode): void {
    const at = this.heads.indexOf(head);
    if (at >= 0) this.heads.splice(at, 1);
  }

  private draw(camera: CameraComponent): void {
    for (let i = 0; i < this.heads.length; i++) {
      const head = this.heads[i] as AvatarNode;
      const { instance } = head;
      instance.visible = head.enabled;
      setWorld(instance.world, head.getWorldTransform().data, false);
    }
    this.host?.draw(camera);
  }
}
