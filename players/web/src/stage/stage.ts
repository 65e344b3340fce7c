// The canvas, the player and the frame loop: draws only after a change, and allocates nothing a frame.
import type { Avatar } from "../avatar.js";
import { Camera } from "../camera.js";
import { AvatarError } from "../errors.js";
import type { Instance } from "../instance.js";
import type { Light } from "../light/light.js";
import { Player } from "../player.js";
import type { Background } from "../renderer.js";
import { Orbit, type Controls } from "./orbit.js";

const SHARP = 2; // physical pixels of a CSS pixel: screens of phones have up to 4, and get more than SHARP where the picture is small
const MOST_PIXELS = 4e6; // of such a picture
const NEAR = "25%"; // of the window: what is as near to it counts as seen
const STILL_MS = 500; // how old the kept picture may become while things move

/** Changes the pose before a frame. True: it goes on moving, so another frame follows. */
export type Mover = (nowMs: number) => boolean;

const TOUCH: Readonly<Record<Controls, string>> = { all: "none", page: "pan-y", none: "auto" };

/** What the stage reports to its page or element. */
export interface StageEvents {
  /** It came onto the screen, or left it. Out of sight nothing is drawn but the first picture of an avatar. */
  seen(onScreen: boolean): void;
  /** After each frame was asked for. */
  drawn(): void;
  /** Before the stage waits for the newest frame. */
  awaiting(): void;
  /** When a frame that was awaited is on the canvas. */
  settled(): void;
  /** The device is gone; the last picture stays. `Stage.restart` goes on. */
  lost(reason: string): void;
  /** Drawing failed; nothing is drawn until something changes. */
  failed(error: unknown): void;
}

/** Draws one avatar. */
export class Stage {
  readonly orbit = new Orbit();
  readonly movers: Mover[] = [];
  player: Player | null = null;
  instance: Instance | null = null;
  avatar: Avatar | null = null;
  /** Frames drawn since the page was opened. */
  frames = 0;
  /** Milliseconds from frame to frame while things move, smoothed; 0: nothing has moved. */
  frameMs = 0;
  private counted = 0; // images of the player
  private sinceImage = 0; // ms
  /** Draw all the time, for a video. */
  continuous = false;
  /** `settled` is wanted for the next frame, even while things move. */
  watched = false;
  /** Level of detail, or null: chosen by the size on the screen. */
  level: number | null = null;

  private canvas: HTMLCanvasElement;
  private called = "Avatar";
  private onScreen = true; // until the browser has looked
  private kept = false; // after a loss: the canvas still has its picture, and goes on with WebGL2
  private disposed = false;
  private readonly camera = new Camera();
  private readonly sizes = new ResizeObserver(() => this.resize());
  private readonly places = new IntersectionObserver(
    (entries) => {
      this.onScreen = entries.at(-1)?.isIntersecting ?? true;
      this.events.seen(this.onScreen);
      if (this.onScreen) this.ask();
    },
    { rootMargin: NEAR },
  );
  private readonly still: HTMLCanvasElement; // the last good frame, shown when the device is gone
  private stillAt = 0;
  private colour: Background = null;
  private lit: Light | null = null;
  private pending = false;
  private settling = false;
  private readonly stillContext: CanvasRenderingContext2D | null;
  private first = true; // no picture of this avatar yet
  private ratio = 0; // physical pixels of a CSS pixel
  private chosen = -1; // level by the height in the image; -1: none yet
  private lastFrameMs = 0;
  private wasMoving = false;

  constructor(
    private readonly parent: HTMLElement,
    private readonly backend: "webgpu" | "webgl2" | undefined,
    private readonly events: StageEvents,
  ) {
    this.still = canvasWith({ class: "still", "aria-hidden": "true" });
    this.stillContext = this.still.getContext("2d");
    this.canvas = this.newCanvas();
    parent.append(this.still, this.canvas);
    this.orbit.moved = () => this.ask();
    this.sizes.observe(parent);
    this.places.observe(parent);
    document.addEventListener("visibilitychange", this.ask);
  }

  /** Makes the player. Throws AvatarError where the browser cannot draw. */
  async start(): Promise<void> {
    const canvas = this.canvas;
    const backend = this.kept ? "webgl2" : this.backend;
    const player = await Player.create(canvas, backend === undefined ? {} : { backend });
    if (this.disposed) {
      player.dispose();
      return;
    }
    this.player = player;
    void player.lost.then((reason) => {
      if (this.player !== player) return;
      this.player = null;
      player.dispose();
      this.kept = player.backend === "webgl2";
      if (!this.kept) canvas.style.visibility = "hidden"; // the still shows
      this.events.lost(reason);
    });
  }

  /** A new player after a loss. The page shows its avatar again. */
  async restart(): Promise<void> {
    if (!this.kept) {
      const fresh = this.newCanvas();
      this.canvas.replaceWith(fresh);
      this.canvas = fresh;
    }
    this.instance = null; // it went with its player
    await this.start();
  }

  /** Shows an avatar in place of the one before. Throws AvatarError, and the old one stays, if a limit is exceeded. */
  show(avatar: Avatar): Instance {
    if (this.player === null) throw new AvatarError("nothing can be drawn until the graphics device is restarted");
    const next = this.player.add(avatar, { level: avatar.levels.length - 1 }); // until a frame knows what the size asks for
    if (avatar.relight !== null) next.light = this.lit;
    this.instance?.dispose(); // only now: the old one stays where the new one cannot be added
    this.instance = next;
    this.avatar = avatar;
    this.first = true;
    this.chosen = -1;
    this.ask();
    return next;
  }

  /** Display-referred rgb, 0 to 1; null: transparent. */
  set background(colour: Background) {
    this.colour = colour;
    this.ask();
  }

  get background(): Background {
    return this.colour;
  }

  /** The light of the scene, which later avatars have too, where they can; null: as trained. Throws as `Instance.light`. */
  set light(light: Light | null) {
    if (this.instance !== null) this.instance.light = light;
    this.lit = light;
    this.ask();
  }

  /** The canvas that is drawn on now. */
  get element(): HTMLCanvasElement {
    return this.canvas;
  }

  /** What a hand can do with the view. */
  set controls(controls: Controls) {
    this.orbit.controls = controls;
    this.dress(this.canvas);
  }

  /** What a screen reader calls the picture. */
  set label(label: string) {
    this.called = label;
    this.dress(this.canvas);
  }

  /** Draws soon: at most once a frame of the screen. */
  readonly ask = (): void => {
    if (this.pending || this.player === null || document.hidden) return; // `visibilitychange` asks again
    this.pending = true;
    requestAnimationFrame(this.tick);
  };

  /** Frees everything, and takes the canvas out of the page. */
  dispose(): void {
    this.disposed = true;
    this.sizes.disconnect();
    this.places.disconnect();
    document.removeEventListener("visibilitychange", this.ask);
    this.player?.dispose();
    this.player = this.instance = this.avatar = null;
    this.still.remove();
    this.canvas.remove();
  }

  /** Draws a frame and resolves when it is on the canvas, which can be read until the task ends. */
  async drawn(): Promise<void> {
    this.draw();
    await this.player?.finished();
    if (this.player?.backend === "webgpu") this.paint(); // what it showed in another task cannot be read
  }

  private draw(): void {
    if (this.paint()) this.frames++;
  }

  private paint(): boolean {
    if (this.player === null || this.instance === null) return false;
    if (this.ratio !== devicePixelRatio) this.resize(); // a window on another screen
    this.orbit.place(this.camera);
    this.chooseLevel();
    this.player.frame(this.camera, this.colour);
    return true;
  }

  private readonly tick = (now: number): void => {
    this.pending = false;
    if (document.hidden || this.player === null || !(this.onScreen || this.first)) return; // coming back asks again
    let moving = this.orbit.step(now);
    for (let i = 0; i < this.movers.length; i++) if (this.movers[i]!(now)) moving = true;
    try {
      this.draw();
    } catch (error) {
      this.events.failed(error);
      return;
    }
    if (this.wasMoving) this.measure(now - this.lastFrameMs);
    this.wasMoving = moving;
    this.lastFrameMs = now;
    this.events.drawn();
    if (moving || this.continuous) this.ask();
    if (!moving || this.watched || now - this.stillAt > STILL_MS) this.settle();
  };

  /** Waits for the newest frame, and keeps its picture. */
  private settle(): void {
    const player = this.player;
    if (player === null || this.settling) return;
    this.settling = true;
    this.watched = false;
    this.stillAt = performance.now();
    this.events.awaiting();
    const asked = this.frames;
    player.finished().then(
      () => {
        this.settling = false;
        if (this.player !== player) return;
        this.first = false;
        if (player.backend === "webgpu") {
          this.paint();
          this.keepStill();
        }
        this.events.settled();
        if (this.watched || (this.frames !== asked && !this.pending)) this.settle();
      },
      () => {
        this.settling = false; // the device is lost, and `lost` says so
      },
    );
  }

  /** Keeps what is on the canvas, for the time after a lost device. */
  private keepStill(): void {
    const { width, height } = this.canvas;
    if (width === 0 || height === 0) return;
    if (this.still.width !== width) this.still.width = width;
    if (this.still.height !== height) this.still.height = height;
    this.stillContext?.clearRect(0, 0, width, height);
    this.stillContext?.drawImage(this.canvas, 0, 0);
  }

  /** The time from image to image: on WebGL2 the worker may make fewer images than the page asks for. */
  private measure(past: number): void {
    const images = this.player?.images ?? 0;
    this.sinceImage += past;
    if (images > this.counted) {
      const each = this.sinceImage / (images - this.counted);
      this.frameMs += (each - this.frameMs) * (this.frameMs === 0 ? 1 : 0.1);
      this.sinceImage = 0;
    }
    this.counted = images;
  }

  /** The coarsest level that serves the avatar's height in the image, unless a person chose one. */
  private chooseLevel(): void {
    const { instance, avatar } = this;
    if (instance === null || avatar === null) return;
    const level = this.level ?? (this.chosen = instance.levelFor(this.camera, this.chosen));
    if (level < avatar.levels.length && level !== instance.level) instance.level = level;
  }

  private newCanvas(): HTMLCanvasElement {
    const canvas = canvasWith({ class: "view" });
    this.dress(canvas);
    this.orbit.listen(canvas);
    return canvas;
  }

  /** Says what the canvas is, and whose fingers are whose. */
  private dress(canvas: HTMLCanvasElement): void {
    const { controls } = this.orbit;
    const moved = controls !== "none";
    canvas.style.touchAction = TOUCH[controls];
    canvas.setAttribute("role", moved ? "application" : "img");
    canvas.setAttribute("aria-label", moved ? `${this.called}. Arrow keys turn it, plus and minus zoom.` : this.called);
    canvas.removeAttribute("aria-roledescription");
    canvas.removeAttribute("tabindex");
    if (!moved) return;
    canvas.setAttribute("aria-roledescription", "3D view");
    canvas.tabIndex = 0;
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.parent;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.ratio = devicePixelRatio;
    const scale = Math.min(this.ratio, Math.max(SHARP, Math.sqrt(MOST_PIXELS / (clientWidth * clientHeight))));
    this.orbit.resize(Math.max(1, Math.round(clientWidth * scale)), Math.max(1, Math.round(clientHeight * scale)));
    this.ask();
  }
}

function canvasWith(attributes: Readonly<Record<string, string>>): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  for (const [name, value] of Object.entries(attributes)) canvas.setAttribute(name, value);
  return canvas;
}
