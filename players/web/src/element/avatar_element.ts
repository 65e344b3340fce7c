// The element: attributes and methods in, pictures and events out.
import type { Avatar } from "../avatar.js";
import { AvatarError } from "../errors.js";
import type { Light } from "../light/light.js";
import { load } from "../load.js";
import type { Pose } from "../pose/pose.js";
import { Stage } from "../stage/stage.js";
import { OBSERVED, PROPERTIES, defineProperties } from "./attributes.js";
import { Motion } from "./motion.js";
import { PointerGaze } from "./pointer.js";
import { Shadow } from "./shadow.js";

const MOST_LOSSES = 3; // of the graphics device, after which it stays away
const LOSS_MS = 500; // before it is asked for again

// Where there are no elements, as in Node, the module can be imported all the same.
const Base = (typeof HTMLElement === "undefined" ? class {} : HTMLElement) as typeof HTMLElement;
const reduced = typeof matchMedia === "undefined" ? null : matchMedia("(prefers-reduced-motion: reduce)");
let seeds = 0; // avatars of a page blink at different times

/** `<gaussian-avatar>`. Properties of attributes are texts or null, and booleans; they change it at any time. */
export class GaussianAvatarElement extends Base {
  static readonly observedAttributes: readonly string[] = OBSERVED;

  /** The address of the pack. */
  declare src: string | null;
  /** The address of a picture until the first frame; without it, that of the pack. */
  declare poster: string | null;
  /** The name of the clip that plays; without it, the first. */
  declare clip: string | null;
  /** "off": it keeps still while no clip plays. */
  declare idle: string | null;
  /** "pointer": eyes and head follow it. */
  declare look: string | null;
  /** The level of detail, 0 the finest; without it, what the size on the screen asks for. */
  declare level: string | null;
  /** The light of the scene: "studio", "left", "rim", JSON, or the address of a file of it; without it, as trained. */
  declare light: string | null;
  /** What a screen reader says. */
  declare alt: string | null;
  /** "webgpu" or "webgl2"; without it, what the browser has. */
  declare backend: string | null;
  /** Plays the clip as soon as it is there, unless the visitor wants less motion. */
  declare autoplay: boolean;
  /** A hand turns and zooms the view. */
  declare cameraControls: boolean;

  private readonly parts = new Shadow(this);
  private readonly seed = seeds++;
  private readonly drawnEvent = new Event("frame"); // one for all frames
  private stage: Stage | null = null;
  private gaze: PointerGaze | null = null;
  private motion: Motion | null = null;
  private started: Promise<void> | null = null; // of the stage's player
  private loading: AbortController | null = null;
  private seen = false; // it has been on the screen: it loads from then on
  private awaited = false; // the first picture of this avatar
  private losses = 0;
  private leaving: ReturnType<typeof setTimeout> | undefined;

  /** The avatar that is shown, with the names of its expressions, joints and clips; null before `load`. */
  get avatar(): Avatar | null {
    return this.stage?.avatar ?? null;
  }

  /** The pose: write it, then call `draw`. Clips write it too; life is added to it. null before `load`. */
  get pose(): Pose | null {
    return this.motion?.pose ?? null;
  }

  /** True while a clip plays. */
  get playing(): boolean {
    return this.motion?.playing ?? false;
  }

  /** Sets the weight of an expression. Throws AvatarError for a name that the avatar does not have, and before `load`. */
  setExpression(name: string, weight: number): void {
    this.moving().pose.setExpression(name, weight);
    this.draw();
  }

  /** Plays a clip, by default that of the attribute, until `pause`, or once. Throws AvatarError as `setExpression` does. */
  play(clip: string | null = this.clip, { loop = true }: { loop?: boolean } = {}): void {
    this.moving().play(clip, loop);
    this.draw();
  }

  /** Stops the clip where it is. */
  pause(): void {
    this.motion?.pause();
    this.draw();
  }

  /** Draws soon: for what `pose` changed. */
  draw(): void {
    this.stage?.ask();
  }

  /** The picture as it is now, in physical pixels. Throws AvatarError before `load`. */
  async toBlob(type = "image/png", quality?: number): Promise<Blob> {
    this.moving();
    const { stage } = this;
    await stage?.drawn();
    const blob = await new Promise<Blob | null>((done) => stage?.element.toBlob(done, type, quality));
    if (blob === null) throw new AvatarError("the browser gives no picture of the canvas");
    return blob;
  }

  /** @internal */
  connectedCallback(): void {
    clearTimeout(this.leaving); // it was moved
    if (this.stage === null) this.enter();
  }

  /** @internal */
  disconnectedCallback(): void {
    this.leaving = setTimeout(() => this.leave());
  }

  /** @internal */
  attributeChangedCallback(name: string, old: string | null, value: string | null): void {
    if (this.stage === null || old === value) return;
    if (name === "src") void this.load();
    else if (name === "poster" && (this.parts.hasPoster || this.avatar === null)) this.parts.setPoster(value);
    else if (name === "backend") this.restart();
    else if (name === "light") void this.asked().then((light) => value === this.light && this.shine(light));
    else if ((name === "clip" && this.playing) || (name === "autoplay" && !this.playing)) this.autoPlay();
    this.dress();
  }

  private moving(): Motion {
    if (this.motion === null) throw new AvatarError("no avatar is shown yet; wait for the event load", { owner: `<${this.localName}>` });
    return this.motion;
  }

  private enter(): void {
    for (const name of PROPERTIES) this.takeOver(name);
    const { backend } = this;
    const stage = new Stage(this.parts.stage, backend === "webgpu" || backend === "webgl2" ? backend : undefined, {
      seen: (onScreen) => this.see(onScreen),
      drawn: () => this.dispatchEvent(this.drawnEvent),
      awaiting: () => undefined,
      settled: () => this.settled(),
      lost: (reason) => void this.lost(stage, reason),
      failed: (error) => this.fail(error),
    });
    this.stage = stage;
    stage.movers.push((nowMs) => this.move(nowMs));
    this.gaze = new PointerGaze(this, stage.orbit, () => this.motion?.life?.look, stage.ask);
    this.parts.stage.onkeydown = (event) => {
      if (!(event.ctrlKey || event.metaKey || event.altKey) && stage.orbit.press(event.key)) event.preventDefault();
    };
    this.parts.setPoster(this.poster);
    this.dress();
  }

  /** Gives everything back. */
  private leave(): void {
    this.loading?.abort();
    if (this.gaze !== null) this.gaze.on = false;
    this.stage?.dispose();
    this.stage = this.gaze = this.motion = this.started = this.loading = null;
    this.seen = this.awaited = false;
    this.losses = 0;
    this.parts.setError(null);
    this.parts.setPoster(null);
  }

  private restart(): void {
    this.leave();
    this.enter();
  }

  /** A property that was set before the element was defined hides the real one. */
  private takeOver(name: string): void {
    if (!Object.hasOwn(this, name)) return;
    const given = Reflect.get(this, name) as unknown;
    Reflect.deleteProperty(this, name);
    Reflect.set(this, name, given);
  }

  /** Does what the attributes say that need no loading. */
  private dress(): void {
    const { stage, level } = this;
    if (stage === null || this.gaze === null) return;
    stage.controls = this.cameraControls ? "page" : "none";
    stage.label = this.alt ?? this.avatar?.name ?? "Avatar";
    stage.level = level !== null && /^\d+$/.test(level) ? Number(level) : null;
    this.gaze.on = this.look === "pointer";
    stage.ask();
  }

  private see(onScreen: boolean): void {
    if (!onScreen || this.seen) return;
    this.seen = true;
    void this.load();
  }

  /** Loads what `src` names. What was shown before stays until then. */
  private async load(): Promise<void> {
    this.loading?.abort();
    this.loading = null;
    this.parts.setError(null);
    this.parts.setProgress(null);
    const { stage, src } = this;
    if (stage === null || !this.seen || src === null) return;
    const controller = (this.loading = new AbortController());
    const { signal } = controller;
    this.parts.setProgress(NaN);
    try {
      this.started ??= stage.start().catch((error: unknown) => {
        if (this.stage === stage) this.started = null; // the next load tries again
        throw error;
      });
      const onProgress = (loaded: number, total: number | null): void => this.progressed(loaded, total);
      const [avatar, light] = await Promise.all([load(src, { signal, onProgress }), this.asked(), this.started]);
      if (!signal.aborted) this.show(stage, avatar, light);
    } catch (error) {
      if (!signal.aborted) this.fail(error);
      controller.abort(); // a download that nobody waits for
    }
    if (this.loading === controller) this.parts.setProgress(null);
  }

  private progressed(loaded: number, total: number | null): void {
    const known = total !== null && total > 0;
    this.parts.setProgress(known ? loaded / total : NaN);
    this.dispatchEvent(new ProgressEvent("progress", { lengthComputable: known, loaded, total: total ?? 0 }));
  }

  private show(stage: Stage, avatar: Avatar, light: Light | null): void {
    const first = stage.avatar === null;
    stage.show(avatar);
    stage.orbit.setFraming(avatar.framing, false);
    this.motion = new Motion(avatar, this.seed, () => this.draw());
    this.awaited = true;
    if (first && this.poster === null) this.parts.setPoster(avatar.preview);
    this.dress();
    this.shine(light);
    this.autoPlay();
  }

  /** The light that the attribute says. Where it cannot be had, the avatar is shown as trained. */
  private async asked(): Promise<Light | null> {
    const { light } = this;
    try {
      return light === null ? null : await (await import("../light/asked.js")).lightAsked(light);
    } catch (error) {
      this.tell(error);
      return null;
    }
  }

  private shine(light: Light | null): void {
    try {
      if (this.stage !== null && this.avatar !== null) this.stage.light = light;
    } catch (error) {
      this.tell(error);
    }
  }

  private autoPlay(): void {
    if (!this.autoplay || this.motion === null || reduced?.matches === true) return;
    if (this.clip === null && this.avatar?.clips.length === 0) return;
    try {
      this.motion.play(this.clip, true);
    } catch (error) {
      this.tell(error); // the avatar is shown all the same
    }
  }

  private move(nowMs: number): boolean {
    const { motion } = this;
    const out = this.stage?.instance?.pose;
    if (motion === null || out === undefined) return false;
    return motion.move(nowMs, this.idle !== "off" && reduced?.matches !== true, out);
  }

  private settled(): void {
    if (!this.awaited) return;
    this.awaited = false;
    this.parts.setPoster(null);
    this.dispatchEvent(new Event("load"));
  }

  private async lost(stage: Stage, reason: string): Promise<void> {
    const { avatar } = stage;
    if (++this.losses > MOST_LOSSES) {
      this.fail(new AvatarError(`the graphics device was lost (${reason}); load the page again`));
      return;
    }
    await new Promise((done) => setTimeout(done, LOSS_MS));
    if (this.stage !== stage) return;
    try {
      await stage.restart();
      if (avatar !== null && this.stage === stage) stage.show(avatar);
    } catch (error) {
      this.fail(error);
    }
  }

  private fail(error: unknown): void {
    this.parts.setError(error instanceof Error ? error.message : String(error));
    this.tell(error);
  }

  private tell(error: unknown): void {
    this.dispatchEvent(new ErrorEvent("error", { error, message: error instanceof Error ? error.message : String(error) }));
  }
}

defineProperties(GaussianAvatarElement.prototype);
