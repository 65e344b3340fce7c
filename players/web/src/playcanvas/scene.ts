// Avatars as entities of a PlayCanvas scene.

import { Entity, EventHandler, LAYERID_WORLD, type AppBase, type CameraComponent, type EventHandle, type Layer } from "playcanvas";
import type { Avatar } from "../avatar.js";
import type { Camera as Seen } from "../camera.js";
import { Crowd, type AvatarHost, type AvatarSceneOptions as SharedOptions } from "../engine/host.js";
import { SceneLights } from "../engine/lights.js";
import type { Rigs } from "../engine/rig_mesh.js";
import { rigsFor } from "../engine/rigs.js";
import { seenAs, setPlace } from "../engine/view.js";
import type { Instance } from "../instance.js";
import type { Pose } from "../pose/pose.js";
import { ShadowCaster } from "./caster.js";
import { hostOf } from "./host.js";
import { collect, FALLOFF } from "./lights.js";

/** Options of `AvatarScene.create`. */
export interface AvatarSceneOptions extends SharedOptions {
  /** The layer after whose transparent meshes avatars are drawn, and whose lights see what casts their shadows. The default is World. */
  readonly layer?: number;
}

/**
 * An avatar in a scene of PlayCanvas. Its transform may be any, and any entity may be its parent. It is drawn while it is
 * enabled and below the root of the application.
 */
export class AvatarNode extends Entity {
  /** @internal null: it casts no shadow. */
  readonly caster: ShadowCaster | null = null;

  /** @internal `AvatarScene.addAvatar` makes them. */
  constructor(
    private readonly instance: Instance,
    app: AppBase,
    layer: number,
    rigs: Rigs | null,
    private readonly free: (one: AvatarNode) => void,
  ) {
    super(instance.avatar.name, app);
    const rig = rigs?.add(instance.avatar);
    if (rig) this.caster = new ShadowCaster(app, layer, this, rig, instance.pose);
  }

  get avatar(): Avatar {
    return this.instance.avatar;
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

  /** The coarsest level that shows the avatar to a camera as the finest does, in an image of `height` physical pixels. */
  levelFor(camera: CameraComponent, height: number): number {
    return this.instance.levelFor(this.seenBy(camera, height));
  }

  /** Physical pixels that the avatar stands tall in an image of `height` of them. Infinite unless it is before the camera. */
  heightPx(camera: CameraComponent, height: number): number {
    return this.instance.heightPx(this.seenBy(camera, height));
  }

  /** Removes the avatar from the scene and frees what it holds on the GPU. */
  override destroy(): void {
    this.free(this);
    this.caster?.destroy();
    super.destroy();
  }

  /** The camera as one of this package; the instance is placed as this entity stands now. */
  private seenBy(camera: CameraComponent, height: number): Seen {
    setPlace(this.instance.place, this.getWorldTransform().data, false);
    return seenAs(camera.viewMatrix.data, camera.projectionMatrix.data, height);
  }
}

/** All avatars of an application, sorted together. It fires "change" when there is a newer picture than the one shown. */
export class AvatarScene extends EventHandler {
  private readonly crowd: Crowd<AvatarNode, CameraComponent>;
  private readonly handles: EventHandle[];

  private constructor(
    readonly app: AppBase,
    host: AvatarHost<CameraComponent>,
    private readonly drawnAfter: number,
    lights: boolean,
    private readonly rigs: Rigs | null,
  ) {
    super();
    const isShown = (head: AvatarNode): boolean => head.enabled && head.isDescendantOf(app.root);
    const place = (head: AvatarNode, instance: Instance): void => {
      instance.visible = isShown(head);
      setPlace(instance.place, head.getWorldTransform().data, false);
    };
    this.crowd = new Crowd(host, place, lights ? new SceneLights(FALLOFF) : null, (into) => collect(into, app, drawnAfter));
    const cast = (head: AvatarNode): void => head.caster?.takePose(isShown(head));
    this.handles = [
      app.on("prerender", () => this.crowd.each(cast)),
      app.scene.on("postrender:layer", (camera: CameraComponent, layer: Layer, transparent: boolean) => {
        if (transparent && layer.id === drawnAfter) this.crowd.draw(camera);
      }),
      app.on("destroy", () => this.destroy()),
    ];
  }

  /** Throws AvatarError where the graphics device of the application cannot draw avatars. */
  static async create(app: AppBase, options: AvatarSceneOptions = {}): Promise<AvatarScene> {
    let made: AvatarScene | null = null;
    const layer = options.layer ?? LAYERID_WORLD;
    const rigs = await rigsFor(options);
    const host = await hostOf(app, layer, options, () => made?.fire("change"));
    return (made = new AvatarScene(app, host, layer, options.lights ?? true, rigs));
  }

  /** Resolves with a reason when no more avatars can be drawn. */
  get lost(): Promise<string> {
    return this.crowd.lost;
  }

  /** Puts an avatar under the root. Throws AvatarError where it exceeds a limit of the GPU, or has no such level. */
  addAvatar(avatar: Avatar, options: { readonly level?: number } = {}): AvatarNode {
    const free = (one: AvatarNode): void => this.crowd.remove(one);
    const head = this.crowd.add(avatar, options.level ?? 0, (instance) => new AvatarNode(instance, this.app, this.drawnAfter, this.rigs, free));
    this.app.root.addChild(head);
    return head;
  }

  /** Resolves when all that the last picture asked for is computed. On WebGL2, the next picture shows it. */
  finished(): Promise<void> {
    return this.crowd.finished();
  }

  /** Destroys all avatars and frees everything on the GPU. The application goes on. */
  destroy(): void {
    for (const handle of this.handles) handle.off();
    this.crowd.dispose((head) => head.destroy());
    this.off();
  }
}
