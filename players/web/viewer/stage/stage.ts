// The canvas, the player and the frame loop: draws only after a change, and allocates nothing a frame.
import { AvatarError, Camera, Player, type Avatar, type Background, type Instance } from "../../src/index.js";
import { make } from "../parts/dom.js";
import { Orbit } from "./orbit.js";

const MOST_PIXELS_A_POINT = 2; // screens of phones have up to 4; splats cost more than that shows
const STILL_MS = 500; // how old the kept picture may become while things move

/** Changes the pose before a frame. True: it goes on moving, so another frame follows. */
export type Mover = (nowMs: number) => boolean;

/** What the stage reports to the page. */
export interface StageEvents {
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

/** What says that the browser cannot draw, in plain words; null if it can. */
export function missingGraphics(): string | null {
  if ("gpu" in navigator) return null;
  if (document.createElement("canvas").getContext("webgl2") !== null) return null;
  return (
    "This browser has neither WebGPU nor WebGL2, so it cannot draw avatars. " +
    "Use a current Chrome, Edge, Firefox or Safari, and switch hardware acceleration on in its settings."
  );
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
  private readonly camera = new Camera();
  private readonly still: HTMLCanvasElement; // the last good frame, shown when the device is gone
  private stillAt = 0;
  private colour: Background = null;
  private pending = false;
  private settling = false;
  private readonly stillContext: CanvasRenderingContext2D | null;
  private first = true; // no picture of this avatar yet
  private chosen = -1; // level by the height in the image; -1: none yet
  private lastFrameMs = 0;
  private wasMoving = false;

  constructor(
    private readonly parent: HTMLElement,
    private readonly backend: "webgpu" | "webgl2" | undefined,
    private readonly events: StageEvents,
  ) {
    this.still = make("canvas", { class: "still", "aria-hidden": "true" });
    this.stillContext = this.still.getContext("2d");
    this.canvas = this.newCanvas();
    parent.append(this.still, this.canvas);
    this.orbit.moved = () => this.ask();
    new ResizeObserver(() => this.resize()).observe(parent);
    document.addEventListener("visibilitychange", () => {
      if (!document.hidden) this.ask();
    });
  }

  /** Makes the player. Throws AvatarError where the browser cannot draw. */
  async start(): Promise<void> {
    const canvas = this.canvas;
    const player = await Player.create(canvas, this.backend === undefined ? {} : { backend: this.backend });
    this.player = player;
    void player.lost.then((reason) => {
      if (this.player !== player) return;
      this.player = null;
      player.dispose();
      canvas.style.visibility = "hidden"; // the kept picture shows
      this.events.lost(reason);
    });
  }

  /** A new canvas and player after a loss. The page shows its avatar again. */
  async restart(): Promise<void> {
    const fresh = this.newCanvas();
    this.canvas.replaceWith(fresh);
    this.canvas = fresh;
    this.instance = null; // it went with its player
    await this.start();
  }

  /** Shows an avatar in place of the one before. Throws AvatarError, and the old one stays, if a limit is exceeded. */
  show(avatar: Avatar): Instance {
    if (this.player === null) throw new AvatarError("nothing can be drawn until the graphics device is restarted");
    const coarsest = avatar.levels.length - 1; // the quickest first picture
    const next = this.player.add(avatar, { level: coarsest });
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

  /** The canvas that is drawn on now. */
  get element(): HTMLCanvasElement {
    return this.canvas;
  }

  /** Draws soon: at most once a frame of the screen. */
  ask(): void {
    if (this.pending || this.player === null) return;
    this.pending = true;
    requestAnimationFrame(this.tick);
  }

  /** Draws a frame and resolves when it is on the canvas, which can be read until the task ends. */
  async drawn(): Promise<void> {
    this.draw();
    await this.player?.finished();
  }

  private draw(): void {
    if (this.player === null || this.instance === null) return;
    this.orbit.place(this.camera);
    this.chooseLevel();
    this.player.frame(this.camera, this.colour);
    this.frames++;
  }

  private readonly tick = (now: number): void => {
    this.pending = false;
    if (document.hidden) return; // `visibilitychange` asks again
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

  /** Waits for the newest frame: keeps its picture, and then draws in the detail that the size asks for. */
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
        this.keepStill();
        this.events.settled();
        if (this.refine()) this.ask();
        else if (this.watched || (this.frames !== asked && !this.pending)) this.settle();
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

  private refine(): boolean {
    const before = this.instance?.level;
    this.first = false;
    this.chooseLevel();
    return this.instance?.level !== before;
  }

  /** The coarsest level that serves the avatar's height in the image, unless a person chose one. */
  private chooseLevel(): void {
    const { instance, avatar } = this;
    if (instance === null || avatar === null || this.first) return;
    const level = this.level ?? (this.chosen = instance.levelFor(this.camera, this.chosen));
    if (level < avatar.levels.length && level !== instance.level) instance.level = level;
  }

  private newCanvas(): HTMLCanvasElement {
    const canvas = make("canvas", {
      tabindex: 0,
      role: "application",
      "aria-roledescription": "3D view",
      "aria-label": "Avatar. Arrow keys turn it, plus and minus zoom.",
    });
    this.orbit.listen(canvas);
    return canvas;
  }

  private resize(): void {
    const { clientWidth, clientHeight } = this.parent;
    if (clientWidth === 0 || clientHeight === 0) return;
    const scale = Math.min(MOST_PIXELS_A_POINT, devicePixelRatio);
    this.orbit.resize(Math.max(1, Math.round(clientWidth * scale)), Math.max(1, Math.round(clientHeight * scale)));
    this.ask();
  }
}
