// Avatars as objects of a three.js scene.

import { BufferAttribute, BufferGeometry, Mesh, MeshBasicMaterial, Object3D, type Camera, type Object3DEventMap, type WebGLRenderer } from "three";
import type { WebGPURenderer } from "three/webgpu";
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
import { collector, FALLOFF } from "./lights.js";

const LAST = 1e6; // render order: after the transparent meshes

/**
 * An avatar in a scene of three.js. Its transform may be any, and any object may be its parent; it is drawn while it is
 * in the scene that holds its AvatarScene.
 */
export class AvatarObject extends Object3D {
  readonly isAvatarObject = true;
  override readonly type = "AvatarObject";
  private readonly caster: ShadowCaster | null = null;

  /** @internal `AvatarScene.addAvatar` makes them. */
  constructor(
    private readonly instance: Instance,
    private readonly crowd: Crowd<AvatarObject, Camera>,
    private readonly rigs: Rigs | null,
  ) {
    super();
    this.name = instance.avatar.name;
    const rig = rigs?.add(instance.avatar);
    if (!rig) return;
    this.caster = new ShadowCaster(rig, instance.pose);
    this.caster.layers = this.layers;
    this.add(this.caster);
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

  /** Another object of the avatar, as this one is placed and posed now. It has no parent. */
  override clone(recursive?: boolean): this {
    const other = this.crowd.add(this.avatar, this.level, (instance) => new AvatarObject(instance, this.crowd, this.rigs));
    other.pose.copy(this.pose);
    return other.copy(this, recursive) as this;
  }

  /** As that of any object; each avatar keeps what casts its own shadow. */
  override copy(source: Object3D, recursive = true): this {
    super.copy(source, false);
    if (recursive) for (const child of source.children) if (!(child instanceof ShadowCaster)) this.add(child.clone());
    return this;
  }

  /** Removes the avatar from its parent and frees what it holds on the GPU. It is not drawn again. */
  override dispose(): void {
    this.removeFromParent();
    this.caster?.dispose();
    this.crowd.remove(this);
    super.dispose();
  }

  /** The camera as one of this package; the instance is placed as this object stands now. */
  private seenBy(camera: Camera, height: number): Seen {
    camera.updateWorldMatrix(true, false);
    this.updateWorldMatrix(true, false);
    setPlace(this.instance.place, this.matrixWorld.elements, false);
    return seenAs(camera.matrixWorldInverse.elements, camera.projectionMatrix.elements, height);
  }
}

/** Events of an AvatarScene. */
export interface AvatarSceneEventMap extends Object3DEventMap {
  /** There is a newer picture than the one shown: for pages that draw on demand only. */
  change: object;
}

/** All avatars of a renderer, sorted together. Add it to the scene: avatars are drawn where it stands in the render order. */
export class AvatarScene extends Mesh<BufferGeometry, MeshBasicMaterial, AvatarSceneEventMap> {
  private readonly crowd: Crowd<AvatarObject, Camera>;
  private rendered: Object3D | null = null; // the scene of the picture in hand

  private constructor(host: AvatarHost<Camera>, lights: boolean, private readonly rigs: Rigs | null) {
    super(nothing(), new MeshBasicMaterial({ transparent: true, colorWrite: false, depthWrite: false, depthTest: false }));
    this.name = "avatars";
    this.frustumCulled = false;
    this.renderOrder = LAST;
    const place = (head: AvatarObject, instance: Instance, camera: Camera): void => {
      instance.visible = head.layers.test(camera.layers) && isShown(head, this.rendered);
      setPlace(instance.place, head.matrixWorld.elements, false);
    };
    const collect = collector();
    this.crowd = new Crowd(host, place, lights ? new SceneLights(FALLOFF) : null, (into, camera) => {
      if (this.rendered !== null) collect(into, this.rendered, camera);
    });
    this.onAfterRender = (_, scene, camera) => {
      this.rendered = scene;
      this.crowd.draw(camera);
    };
  }

  /** Throws AvatarError where the renderer cannot draw avatars. */
  static async create(renderer: WebGLRenderer | WebGPURenderer, options: AvatarSceneOptions = {}): Promise<AvatarScene> {
    let made: AvatarScene | null = null;
    const rigs = await rigsFor(options);
    const host = await hostOf(renderer, options, () => made?.dispatchEvent({ type: "change" }));
    return (made = new AvatarScene(host, options.lights ?? true, rigs));
  }

  /** Resolves with a reason when no more avatars can be drawn. */
  get lost(): Promise<string> {
    return this.crowd.lost;
  }

  /**
   * Makes the object of an avatar and adds it to this object; it may move to any other parent. Throws AvatarError where
   * the avatar exceeds a limit of the GPU, or has no such level.
   */
  addAvatar(avatar: Avatar, options: { readonly level?: number } = {}): AvatarObject {
    const head = this.crowd.add(avatar, options.level ?? 0, (instance) => new AvatarObject(instance, this.crowd, this.rigs));
    this.add(head);
    return head;
  }

  /** Resolves when all that the last picture asked for is computed. On WebGL2, the next picture shows it. */
  finished(): Promise<void> {
    return this.crowd.finished();
  }

  /** Disposes of all avatars and frees everything on the GPU. The renderer goes on. */
  override dispose(): void {
    this.removeFromParent();
    this.crowd.dispose((head) => head.dispose());
    this.geometry.dispose();
    this.material.dispose();
    super.dispose();
  }
}

/** Whether an object is in `scene` with nothing above it hidden. */
function isShown(object: Object3D, scene: Object3D | null): boolean {
  for (let at: Object3D | null = object; at !== null; at = at.parent) {
    if (!at.visible) return false;
    if (at === scene) return true;
  }
  return false;
}

/** A triangle without area: renderers call the hooks of an object only where there is something to draw. */
function nothing(): BufferGeometry {
  return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(9), 3));
}
