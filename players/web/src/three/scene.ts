// Avatars as objects of a three.js scene.

import { BufferAttribute, BufferGeometry, Mesh, MeshBasicMaterial, Object3D, type Camera, type Scene, type WebGLRenderer } from "three";
import type { WebGPURenderer } from "three/webgpu";
import type { Avatar } from "../avatar.js";
import type { Instance } from "../instance.js";
import type { Pose } from "../pose/pose.js";
import { madeOf, type DrawingHost, type AvatarSceneOptions } from "../engine/host.js";
import { setWorld } from "../engine/view.js";
import { hostOf } from "./host.js";

const LAST = 1e6; // render order: after the transparent meshes

/** An avatar in the scene. Its transform may be any, and any object may be its parent. */
export class AvatarObject extends Object3D {
  /** @internal `AvatarScene.add` makes them. */
  constructor(
    readonly instance: Instance,
    private readonly forget: (one: AvatarObject) => void,
  ) {
    super();
    this.name = instance.avatar.name;
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

  /** Takes the avatar out of the scene and frees what it holds on the GPU. */
  override dispose(): void {
    this.removeFromParent();
    this.forget(this);
    this.instance.dispose();
    super.dispose();
  }
}

/** All avatars of a renderer, sorted together. Add it to the scene: avatars are drawn where it stands in the render order. */
export class AvatarScene extends Mesh<BufferGeometry, MeshBasicMaterial> {
  /** Called when there is a newer picture than the one shown: for pages that draw on demand only. */
  onUpdate: (() => void) | null = null;
  private readonly heads: AvatarObject[] = [];
  private host: DrawingHost<[Camera]> | null = null;

  private constructor() {
    super(nothing(), new MeshBasicMaterial({ transparent: true, colorWrite: false, depthWrite: false, depthTest: false }));
    this.name = "avatars";
    this.frustumCulled = false;
    this.renderOrder = LAST;
    this.onBeforeRender = (_, scene, camera) => this.place(scene, camera);
    this.onAfterRender = (_, __, camera) => this.host?.draw(camera);
  }

  /** Throws AvatarError where the renderer cannot draw avatars. */
  static async create(renderer: WebGLRenderer | WebGPURenderer, options: AvatarSceneOptions = {}): Promise<AvatarScene> {
    const avatars = new AvatarScene();
    avatars.host = await hostOf(renderer, options.synchronous ?? false, () => avatars.onUpdate?.());
    return avatars;
  }

  /** Resolves with a reason when no more avatars can be drawn. */
  get lost(): Promise<string> {
    return this.made.lost;
  }

  /** Puts an avatar into the scene. Throws AvatarError where it exceeds a limit of the GPU, or has no such level. */
  override add(avatar: Avatar, options?: { readonly level?: number }): AvatarObject;
  override add(...objects: Object3D[]): this;
  override add(first: Avatar | Object3D, ...rest: unknown[]): AvatarObject | this {
    if (first instanceof Object3D) return super.add(first, ...(rest as Object3D[]));
    const { level } = (rest[0] ?? {}) as { level?: number };
    const head = new AvatarObject(this.made.add(first, level ?? 0), (one) => this.forget(one));
    this.heads.push(head);
    super.add(head);
    return head;
  }

  /** Resolves when all that the last picture asked for is computed. On WebGL2, the next picture shows it. */
  finished(): Promise<void> {
    return this.host?.finished() ?? Promise.resolve();
  }

  /** Frees everything on the GPU. The renderer goes on. */
  override dispose(): void {
    for (const head of [...this.heads]) head.dispose();
    this.removeFromParent();
    this.host?.dispose();
    this.host = null;
    this.geometry.dispose();
    this.material.dispose();
    super.dispose();
  }

  private get made(): DrawingHost<[Camera]> {
    return madeOf(this.host);
  }

  private forget(head: AvatarObject): void {
    const at = this.heads.indexOf(head);
    if (at >= 0) this.heads.splice(at, 1);
  }

  /** Where the avatars are, as this camera sees them. */
  private place(scene: Scene, camera: Camera): void {
    for (let i = 0; i < this.heads.length; i++) {
      const head = this.heads[i] as AvatarObject;
      const { instance } = head;
      instance.visible = head.layers.test(camera.layers) && isShown(head, scene);
      setWorld(instance.world, head.matrixWorld.elements, false);
    }
  }
}

/** Whether an object is in `scene` with nothing above it hidden. */
function isShown(object: Object3D, scene: Object3D): boolean {
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
