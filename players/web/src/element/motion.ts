// What moves the avatar of an element: a clip, and its own life.
import type { Avatar } from "../avatar.js";
import { AvatarError, noSuch } from "../errors.js";
import type { Life } from "../life/life.js";
import { Clip } from "../pose/clip.js";
import { Pose } from "../pose/pose.js";

const LONGEST_STEP_S = 0.25; // an element that was out of sight goes on where it stopped

/** The motion of one avatar. Nothing is allocated a frame. */
export class Motion {
  /** What clips and the page say. Life is added to it. */
  readonly pose: Pose;
  /** null until its code is here, which loads after the first picture's. */
  life: Life | null = null;
  private clip: Clip | null = null; // that plays
  private loop = true;
  private seconds = 0; // of the clip
  private lastMs = NaN;

  /** `seed` makes persons differ. `lives` is called when life begins. */
  constructor(
    private readonly avatar: Avatar,
    seed: number,
    lives: () => void,
  ) {
    this.pose = new Pose(avatar);
    const begin = ({ Life }: typeof import("../life/life.js")): void => {
      this.life = new Life(avatar, seed);
      lives();
    };
    import("../life/life.js").then(begin, () => undefined); // without it, the avatar keeps still
  }

  get playing(): boolean {
    return this.clip !== null;
  }

  /** Plays a clip by its name; null: the first. Throws AvatarError if there is no such clip. */
  play(name: string | null, loop: boolean): void {
    const { clips, name: owner } = this.avatar;
    if (clips.length === 0) throw new AvatarError("this avatar has no clip", { owner });
    const names = clips.map((clip) => clip.name);
    const index = name === null ? 0 : names.indexOf(name);
    if (index < 0) throw noSuch("clip", name ?? "", names, { owner });
    this.clip = new Clip(this.avatar, index);
    this.loop = loop;
    this.seconds = 0;
    this.life?.crossfade();
  }

  /** Stops where the clip is. */
  pause(): void {
    this.clip = null;
  }

  /** Writes the pose of this moment. True: it goes on moving. */
  move(nowMs: number, idle: boolean, out: Pose): boolean {
    const past = Math.min((nowMs - this.lastMs) / 1000 || 0, LONGEST_STEP_S);
    this.lastMs = nowMs;
    if (this.clip !== null) this.advance(this.clip, past);
    if (this.life === null) {
      out.copy(this.pose);
      return this.playing;
    }
    this.life.idle = idle && this.clip === null;
    const lives = this.life.pose(nowMs / 1000, this.pose, out);
    return this.playing || lives;
  }

  private advance(clip: Clip, past: number): void {
    this.seconds += past;
    const ended = this.seconds >= clip.seconds;
    if (ended && this.loop && clip.seconds > 0) this.seconds %= clip.seconds;
    clip.pose(this.seconds, this.pose);
    if (!ended || this.loop) return;
    this.clip = null;
    this.pose.reset();
    this.life?.crossfade();
  }
}
