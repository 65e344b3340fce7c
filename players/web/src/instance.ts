// One avatar in a scene: its pose, its place, and the values of the frame that its passes ask for.

import type { Avatar, Relight } from "./avatar.js";
import type { Camera } from "./camera.js";
import { AvatarError } from "./errors.js";
import { FrameValues } from "./frame.js";
import { heightPx, nextLevel } from "./level.js";
import { LIGHT } from "./light/lazy.js";
import type { Light } from "./light/light.js";
import type { Lighting } from "./light/lighting.js";
import type { Level } from "./pack/model.js";
import { multiply } from "./pose/affine.js";
import { Pose } from "./pose/pose.js";
import { Poser } from "./pose/poser.js";

const IDENTITY: readonly number[] = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** What a renderer does with instances. */
export interface InstanceHost {
  /** The set of drawn instances, or the level of one, or whether it can be lit, has changed. */
  changed(instance: Instance): void;
  remove(instance: Instance): void;
}

/** One avatar that a player draws. Several of them may share an avatar. */
export class Instance {
  /** Set it before a frame. */
  readonly pose: Pose;
  /**
   * Scene from the person: row-major 4x4, any affine matrix. The person's frame is right-handed for every pack: +Y up,
   * the face looks along +Z, +X is the person's left. The pose's own movement comes first.
   */
  readonly place = new Float64Array(IDENTITY);
  /** @internal */
  readonly values: FrameValues;
  /** @internal The content of buffer Pose. */
  readonly poseFloats: Float32Array;
  private readonly placed = new Float64Array(16); // scene from the pack's frame
  private readonly posed = new Float64Array(12); // scene from the person at rest
  private readonly poser: Poser;
  /** @internal Whether it has had a light: then the passes of stages shadow and light are there. */
  canBeLit = false;
  private said: Light | null = null;
  private lighting: Lighting | null = null;
  private readonly joint: number; // of the light of the capture: its first float in `poseFloats`, or -1
  private shown = true;
  private at: number;

  /** @internal `Player.add` makes instances. */
  constructor(
    readonly avatar: Avatar,
    private readonly host: InstanceHost,
    level: number,
  ) {
    this.pose = new Pose(avatar);
    this.poser = new Poser(avatar);
    this.values = new FrameValues(avatar.groups.length);
    this.poseFloats = this.poser.update(this.pose).poseFloats;
    this.joint = jointAt(avatar);
    this.at = checkedLevel(avatar, level);
  }

  /** Level of detail, 0 the finest. Throws AvatarError if there is no such level. */
  get level(): number {
    return this.at;
  }

  set level(level: number) {
    if (level === this.at) return;
    this.at = checkedLevel(this.avatar, level);
    this.host.changed(this);
  }

  /** Hidden instances cost nothing. */
  get visible(): boolean {
    return this.shown;
  }

  set visible(visible: boolean) {
    if (visible === this.shown) return;
    this.shown = visible;
    this.host.changed(this);
  }

  /** The light of the scene, in the space that `place` leads to; null: as trained. Throws AvatarError for one that cannot be. */
  get light(): Light | null {
    return this.said;
  }

  set light(light: Light | null) {
    this.setLighting(light);
    this.said = light;
  }

  /** @internal */
  get isLit(): boolean {
    return this.lighting !== null;
  }

  /** @internal The numbers of its light, which the caller may write; they hold until `light` is set. Throws AvatarError if nothing can light it. */
  lit(): Lighting {
    checkRelit(this.avatar);
    this.lighting ??= new (LIGHT.part as NonNullable<typeof LIGHT.part>).Lighting();
    if (!this.canBeLit) {
      this.canBeLit = true;
      this.host.changed(this);
    }
    return this.lighting;
  }

  private setLighting(light: Light | null): void {
    if (light === null) this.lighting = null;
    else this.lit().set(light);
  }

  /** @internal */
  get program(): Level {
    return this.avatar.program.levels[this.at] as Level;
  }

  /** @internal Stage `joints` and the camera. */
  update(camera: Camera): void {
    const { values, lighting, placed } = this;
    const posed = this.poser.update(this.pose);
    values.setPosed(posed);
    values.setCamera(camera, this.placeOfPack());
    values.floats[values.layout.lit] = lighting === null ? 0 : 1;
    lighting?.write(values.floats, values.lightAt, this.avatar.relight as Relight, placed, posed, this.joint);
  }

  /**
   * How tall the avatar stands in the image of a camera, as it is placed and posed now: physical pixels of
   * `framing.whole.size[1]`, facing the camera. Infinite where it is not before the camera.
   */
  heightPx(camera: Camera): number {
    const { posed } = this;
    multiply(posed, 0, this.placeOfPack(), 0, this.pose.worldFromAvatar, 0);
    // `framing` is right-handed for every pack.
    if (this.avatar.handedness === "left") for (let at = 0; at < 12; at += 4) posed[at] = -(posed[at] as number);
    return heightPx(this.avatar.framing.whole, posed, camera.clipFromWorld, camera.height);
  }

  /**
   * The coarsest level that shows the avatar to a camera as the finest does. The level that is shown stays where the
   * height is within a tenth of its borders; `shown` -1: none is shown yet.
   */
  levelFor(camera: Camera, shown = this.at): number {
    return nextLevel(this.avatar.levels, this.heightPx(camera), shown);
  }

  /** The one place where a left-handed pack is mirrored: x of its frame points the other way than the person's. */
  private placeOfPack(): Float64Array {
    const { placed, place } = this;
    placed.set(place);
    if (this.avatar.handedness === "left") for (let at = 0; at < 16; at += 4) placed[at] = -(place[at] as number);
    return placed;
  }

  /** Takes the avatar out of the scene and frees what it holds on the GPU. */
  dispose(): void {
    this.host.remove(this);
  }
}

function jointAt({ relight, skeleton, program }: Avatar): number {
  const joint = relight?.joint ? (skeleton?.names.indexOf(relight.joint) ?? -1) : -1;
  return joint < 0 ? -1 : program.pose.joints + 12 * joint;
}

/** @internal Throws AvatarError if no light of a scene changes its colours. */
export function checkRelit(avatar: Avatar): void {
  if (avatar.relight !== null) return;
  throw new AvatarError("its colours hold an unknown light; make it with `pack --relight`", { owner: avatar.name, field: "light" });
}

function checkedLevel(avatar: Avatar, level: number): number {
  const levels = avatar.program.levels.length;
  if (!Number.isInteger(level) || level < 0 || level >= levels) {
    throw new AvatarError(`there is no level ${level}; the last one is level ${levels - 1}`, {
      owner: avatar.name,
      field: "level",
    });
  }
  return level;
}
