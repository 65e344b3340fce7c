// Plays the avatar's clips and dropped recordings: time, speed, loop and their controls.
import { byId, make, setIcon, setText } from "../parts/dom.js";
import type { Pose } from "../../src/index.js";

const SHOWN_EVERY_MS = 100; // the timeline's text; the picture moves at every frame

/** What a clip and a recording have in common. */
export interface Motion {
  readonly name: string;
  readonly seconds: number;
  readonly fps: number;
  /** Writes the pose at a time, seconds. */
  pose(seconds: number, out: Pose): void;
}

/** The transport bar. */
export class Clips {
  playing = false;
  seconds = 0;
  loop = true;
  /** Whether a clip stops at its end, whatever `loop` says. */
  once: () => boolean = () => false;
  /** Called where a frame is needed. */
  changed: () => void = () => undefined;
  /** Called when playing starts, so that live input is no longer followed. */
  started: () => void = () => undefined;
  /** Called when a clip has come to its end. */
  ended: () => void = () => undefined;

  private motions: Motion[] = [];
  private current: Motion | null = null;
  private pose: Pose | null = null;
  private applied = true; // false: the pose at `seconds` is not written yet
  private over = false; // the clip has come to its end in this frame
  private lastMs = 0;
  private shownMs = 0;
  private readonly bar = byId("transport");
  private readonly play = byId<HTMLButtonElement>("play-button");
  private readonly list = byId<HTMLSelectElement>("clip");
  private readonly timeline = byId<HTMLInputElement>("timeline");
  private readonly time = byId<HTMLOutputElement>("time");
  private readonly speed = byId<HTMLSelectElement>("speed");
  private readonly looping = byId<HTMLButtonElement>("loop-button");

  constructor() {
    this.play.addEventListener("click", () => this.toggle());
    this.list.addEventListener("change", () => this.choose(this.list.selectedIndex));
    this.timeline.addEventListener("input", () => {
      this.pause();
      this.seek(this.timeline.valueAsNumber);
    });
    this.timeline.addEventListener("keydown", (event) => {
      const step = event.key === "ArrowRight" || event.key === "ArrowUp" ? 1 : event.key === "ArrowLeft" || event.key === "ArrowDown" ? -1 : 0;
      if (step === 0) return;
      event.preventDefault();
      this.stepFrames(step);
    });
    this.looping.addEventListener("click", () => this.toggleLoop());
  }

  /** Takes the motions of another avatar. With `keep`, one of the same name goes on at the same time. */
  setAvatar(motions: readonly Motion[], pose: Pose, keep: boolean): void {
    const before = keep ? this.current : null;
    const { seconds, playing } = this;
    this.motions = [...motions];
    this.pose = pose;
    this.pause();
    this.fill();
    const index = this.motions.findIndex((motion) => motion.name === before?.name);
    this.select(Math.max(0, index));
    if (index < 0) return;
    this.seconds = Math.min(seconds, this.current?.seconds ?? 0);
    this.showTime();
    if (playing) this.toggle();
  }

  /** Adds a recording and plays it. One of the same name is replaced. */
  add(motion: Motion): void {
    this.motions = [...this.motions.filter((old) => old.name !== motion.name), motion];
    this.fill();
    this.choose(this.motions.length - 1);
    if (!this.playing) this.toggle();
  }

  /** Plays or pauses. */
  toggle(): void {
    if (this.playing) {
      this.pause();
      return;
    }
    if (this.current === null) return;
    if (this.seconds >= this.current.seconds) this.seconds = 0;
    this.playing = true;
    this.lastMs = -1;
    this.started();
    setIcon(this.play, "pause", "Pause");
    this.changed();
  }

  /** Stops at the present time. */
  pause(): void {
    this.playing = false;
    setIcon(this.play, "play", "Play");
  }

  /** Goes to a time, seconds. */
  seek(seconds: number): void {
    if (this.current === null) return;
    this.started();
    this.seconds = Math.min(this.current.seconds, Math.max(0, seconds));
    this.applied = false;
    this.showTime();
    this.changed();
  }

  /** Goes by single frames of the clip. */
  stepFrames(frames: number): void {
    if (this.current === null) return;
    this.pause();
    this.seek((Math.round(this.seconds * this.current.fps) + frames) / this.current.fps);
  }

  /** Chooses the next speed of the list (1) or the one before (-1). */
  changeSpeed(by: number): void {
    const next = Math.min(this.speed.options.length - 1, Math.max(0, this.speed.selectedIndex + by));
    this.speed.selectedIndex = next;
  }

  /** Goes to the next clip. */
  next(): void {
    if (this.motions.length > 0) this.choose((this.list.selectedIndex + 1) % this.motions.length);
  }

  /** Loops or not. */
  toggleLoop(): void {
    this.loop = !this.loop;
    this.looping.setAttribute("aria-pressed", String(this.loop));
  }

  /** A mover of the stage. */
  readonly move = (nowMs: number): boolean => {
    const motion = this.current;
    if (motion === null || this.pose === null) return false;
    if (this.playing) {
      if (this.lastMs >= 0) this.advance(motion, (nowMs - this.lastMs) / 1000);
      this.lastMs = nowMs;
      this.applied = false;
    }
    if (!this.applied) motion.pose(this.seconds, this.pose);
    this.applied = true;
    if (this.over) this.ended();
    this.over = false;
    if (nowMs - this.shownMs > SHOWN_EVERY_MS) {
      this.shownMs = nowMs;
      this.showTime();
    }
    return this.playing;
  };

  private advance(motion: Motion, past: number): void {
    // A tab that was hidden goes on where it stopped.
    this.seconds += Math.min(past, 0.25) * Number(this.speed.value);
    if (this.seconds < motion.seconds) return;
    if (this.loop && !this.once() && motion.seconds > 0) {
      this.seconds %= motion.seconds;
    } else {
      this.seconds = motion.seconds;
      this.pause();
      this.shownMs = 0;
      this.over = true;
    }
  }

  private fill(): void {
    this.list.replaceChildren(...this.motions.map((motion) => make("option", {}, motion.name)));
    this.bar.hidden = this.motions.length === 0;
  }

  private select(index: number): void {
    this.current = this.motions[index] ?? null;
    this.list.selectedIndex = index;
    this.seconds = 0;
    this.timeline.max = String(this.current?.seconds ?? 1);
    this.showTime();
  }

  private choose(index: number): void {
    this.select(index);
    this.seek(0);
  }

  private showTime(): void {
    const total = this.current?.seconds ?? 0;
    const text = `${this.seconds.toFixed(1)} / ${total.toFixed(1)} s`;
    this.timeline.value = String(this.seconds);
    this.timeline.setAttribute("aria-valuetext", text);
    setText(this.time, text);
  }
}
