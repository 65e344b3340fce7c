// One avatar in a scene: its pose, its place, and the values of the frame that its passes ask for.

import type { Avatar } from "./avatar.js";
import type { Camera } from "./camera.js";
import { AvatarError } from "./errors.js";
import { FrameValues } from "./frame.js";
import type { Level } from "./pack/model.js";
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
  /** Scene from avatar space: row-major 4x4, any affine matrix. The pose's own movement comes first. */
  readonly world = new Float64Array(IDENTITY);
  /** @internal */
  readonly values: FrameValues;
  /** @internal The content of buffer Pose. */
  readonly poseFloats: Float32Array;
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
    this.values.setCamera(camera, this.world);
  }

  /** Takes the avatar out of the scene and frees what it holds on the GPU. */
  dispose(): void {
    this.host.remove(this);
  }
}

function checkedLevel(avatar: Avatar, level: number): number {
  const levels = avatar.program.levels.length;
  if (!Number.isInteger(level) || level < 0 || level >= levels) {
    throw new AvatarError(`there is no level ${level}; it has ${levels}, counted from 0`, {
      owner: avatar.name,
      field: "level",
    });
  }
  return level;
}
