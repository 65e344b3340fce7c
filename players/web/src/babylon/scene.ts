// Avatars as nodes of a Babylon.js scene.

import type { Camera } from "@babylonjs/core/Cameras/camera.js";
import { TransformNode } from "@babylonjs/core/Meshes/transformNode.js";
import { Observable, type Observer } from "@babylonjs/core/Misc/observable.js";
import type { Scene } from "@babylonjs/core/scene.js";
import type { Avatar } from "../avatar.js";
import type { Camera as Seen } from "../camera.js";
import { Crowd, type AvatarHost, type AvatarSceneOptions } from "../engine/host.js";
import { SceneLights } from "../engine/lights.js";
import type { Rigs } from "../engine/rig_mesh.js";
import { rigsFor } from "../engine/rigs.js";
import { seenAs, setPlace } from "../engine/view.js";
import type { Instance } from "../instance.js";
import type { Pose } from "../pose/pose.js";
import { ShadowCaster } from "./caster.js";
import { hostOf } from "./host.js";
import { collect, FALLOFF } from "./lights.js";

/**
 * An avatar in a scene of Babylon.js. Its transform may be any, and any node may be its parent; `setEnabled(false)`
 * hides it, and `scene.removeTransformNode` does until it is added again.
 */
export class AvatarNode extends TransformNode {
  /** For `ShadowGenerator.addShadowCaster`; null: `shadows` was not asked for, or the avatar has no mesh. */
  readonly shadowCaster: ShadowCaster | null = null;

  /** @internal `AvatarScene.addAvatar` makes them. */
  constructor(
    private readonly instance: Instance,
    scene: Scene,
    rigs: Rigs | null,
    private readonly free: (one: AvatarNode) => void,
  ) {
    super(instance.avatar.name, scene);
    const rig = rigs?.add(instance.avatar);
    if (rig) this.shadowCaster = new ShadowCaster(this, rig, instance.pose);
  }

  override getClassName(): string {
    return "AvatarNode";
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
  levelFor(camera: Camera, height: number): number {
    return this.instance.levelFor(this.seenBy(camera, height));
  }

  /** Physical pixels that the avatar stands tall in an image of `height` of them. Infinite unless it is before the camera. */
  heightPx(camera: Camera, height: number): number {
    return this.instance.heightPx(this.seenBy(camera, height));
  }

  /** Takes the avatar out of the scene and frees what it holds on the GPU. */
  override dispose(doNotRecurse?: boolean, disposeMaterialAndTextures?: boolean): void {
    this.free(this);
    this.shadowCaster?.dispose();
    super.dispose(doNotRecurse, disposeMaterialAndTextures);
  }

  /** The camera as one of this package; the instance is placed as this node stands now. */
  private seenBy(camera: Camera, height: number): Seen {
    setPlace(this.instance.place, this.computeWorldMatrix(true).m, !this.getScene().useRightHandedSystem);
    return seenAs(camera.getViewMatrix().m, camera.getProjectionMatrix().m, height);
  }
}

/** All avatars of a scene, sorted together. */
export class AvatarScene {
  /** There is a newer picture than the one shown: for pages that draw on demand only. */
  readonly onChangeObservable = new Observable<AvatarScene>();
  private readonly crowd: Crowd<AvatarNode, Scene>;
  private readonly observers: (Observer<Scene> | null)[];

  private constructor(
    readonly scene: Scene,
    host: AvatarHost<Scene>,
    lights: boolean,
    private readonly rigs: Rigs | null,
  ) {
    const isShown = (head: AvatarNode): boolean => head.isEnabled() && scene.transformNodes.includes(head);
    const place = (head: AvatarNode, instance: Instance): void => {
      instance.visible = isShown(head);
      setPlace(instance.place, head.getWorldMatrix().m, !scene.useRightHandedSystem);
    };
    this.crowd = new Crowd(host, place, lights ? new SceneLights(FALLOFF) : null, collect);
    const cast = (head: AvatarNode): void => head.shadowCaster?.takePose(isShown(head));
    this.observers = [
      scene.onBeforeRenderTargetsRenderObservable.add(() => this.crowd.each(cast)),
      scene.onAfterDrawPhaseObservable.add(() => this.crowd.draw(scene)),
      scene.onDisposeObservable.add(() => this.dispose()),
    ];
  }

  /** Throws AvatarError where the engine of the scene cannot draw avatars. */
  static async create(scene: Scene, options: AvatarSceneOptions = {}): Promise<AvatarScene> {
    let made: AvatarScene | null = null;
    const rigs = await rigsFor(options);
    const host = await hostOf(scene, options, () => made?.onChangeObservable.notifyObservers(made));
    return (made = new AvatarScene(scene, host, options.lights ?? true, rigs));
  }

  /** Resolves with a reason when no more avatars can be drawn. */
  get lost(): Promise<string> {
    return this.crowd.lost;
  }

  /** Puts an avatar into the scene. Throws AvatarError where it exceeds a limit of the GPU, or has no such level. */
  addAvatar(avatar: Avatar, options: { readonly level?: number } = {}): AvatarNode {
    const free = (one: AvatarNode): void => this.crowd.remove(one);
    return this.crowd.add(avatar, options.level ?? 0, (instance) => new AvatarNode(instance, this.scene, this.rigs, free));
  }

  /** Resolves when all that the last picture asked for is computed. On WebGL2, the next picture shows it. */
  finished(): Promise<void> {
    return this.crowd.finished();
  }

  /** Disposes of all avatars and frees everything on the GPU. The scene goes on. */
  dispose(): void {
    for (const observer of this.observers) observer?.remove();
    this.crowd.dispose((head) => head.dispose());
    this.onChangeObservable.clear();
  }
}
