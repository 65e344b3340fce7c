// One avatar in a scene: its pose, its place, and the values of the frame that its passes ask for.

import type { Avatar } from "./avatar.js";
import type { Camera } from "./camera.js";
import { AvatarError } from "./errors.js";
import { FrameValues } from "./frame.js";
import { heightPx, nextLevel } from "./level.js";
import type { Level } from "./pack/model.js";
import { multiply } from "./pose/affine.js";
import { Pose } from "./pose/pose.js";
import { Poser } from "./pose/poser.js";

const IDENTITY: readonly number[] = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** What a renderer does with instances. */
export interface InstanceHost {
  /** The set of drawn instances, or the level of one, has changed. */
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

  /** @internal */
  get program(): Level {
    return this.avatar.program.levels[this.at] as Level;
  }

  /** @internal Stage `joints` and the camera. */
  update(camera: Camera): void {
    this.values.setPosed(this.poser.update(this.pose));
    this.values.setCamera(camera, this.placeOfPack());
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
