// What the avatar does: what clips, sliders and live input say, and the life that goes on above it.
import { Pose, type Avatar, type Instance } from "../../src/index.js";
import { Life } from "../../src/life/life.js";

/** The pose that the page's controls write, and what is drawn of it. */
export class Alive {
  /** What controls write; null: there is no avatar yet. */
  pose: Pose | null = null;
  avatar: Avatar | null = null;
  private instance: Instance | null = null;
  private life: Life | null = null;

  /** `wanted`: whether the avatar lives now. */
  constructor(private readonly wanted: () => boolean) {}

  /** Takes another avatar, at rest. Returns its pose. */
  setAvatar(instance: Instance): Pose {
    this.instance = instance;
    this.avatar = instance.avatar;
    this.life = new Life(instance.avatar);
    this.pose = new Pose(instance.avatar);
    return this.pose;
  }

  /** False where nothing can drive the avatar. */
  get lives(): boolean {
    return this.avatar !== null && this.avatar.driving !== null;
  }

  /** The next pose is another one: it fades in. */
  crossfade(): void {
    this.life?.crossfade();
  }

  /** A mover of the stage, after those that write the pose. */
  readonly move = (nowMs: number): boolean => {
    const { life, pose, instance } = this;
    if (life === null || pose === null || instance === null) return false;
    life.idle = this.wanted();
    return life.pose(nowMs / 1000, pose, instance.pose);
  };
}
