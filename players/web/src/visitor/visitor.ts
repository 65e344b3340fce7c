// The visitor's camera drives an avatar. Pictures go to a tracker inside this page, and nowhere else.

import { AvatarError } from "../errors.js";
import { CHANNELS, type DrivingFrame, drivingFrame, setChannels } from "../pose/arkit.js";
import { openCamera } from "./camera.js";
import type { FromTracker, Seen } from "./messages.js";
import { type Files, Tracker } from "./tracker.js";

/** How a visitor is followed. */
export interface VisitorOptions {
  /** Where the tracker's files lie, on this site: a folder's address, or the address of each file. */
  readonly files: Files;
  /** As a mirror shows it (the default): a visitor's left moves what is at the left of the screen. */
  readonly mirror?: boolean;
  /** Pictures to follow instead of the camera's, such as `canvas.captureStream()`. */
  readonly stream?: MediaStream;
  /** Called for each picture that was looked at. */
  readonly onFrame?: (visitor: Visitor) => void;
  /** Called once if it ends by itself: the camera was taken away, or the tracker failed. */
  readonly onEnd?: (error: AvatarError) => void;
  /** Called while the tracker's files load. */
  readonly onProgress?: (loadedBytes: number) => void;
  /** Gives the camera back at once, also while the tracker loads; `start` then throws. */
  readonly signal?: AbortSignal;
}

/** A visitor before the camera. */
export class Visitor {
  /** What the visitor's face does, in radians and weights 0 to 1. It stays as it was while no face is seen. */
  readonly frame: DrivingFrame = drivingFrame();
  /** When the picture of `frame` was taken, milliseconds as of performance.now. */
  frameMs = 0;
  /** What is seen now. */
  seen: Seen = "learning";

  private tracker: Tracker | null = null;
  private spare: Float32Array<ArrayBuffer> | null = new Float32Array(CHANNELS.length);
  private shown = -1; // seconds of the video
  private stopped = false;

  private constructor(
    private readonly options: VisitorOptions,
    /** The pictures, for a page that shows them. */
    readonly video: HTMLVideoElement,
    private readonly camera: MediaStream | null, // null: the caller's stream
  ) {}

  /**
   * Opens the camera, loads the tracker and follows. Call it in answer to a click: the browser asks the visitor.
   * Throws AvatarError in one sentence where that cannot be; nothing goes on then.
   */
  static async start(options: VisitorOptions): Promise<Visitor> {
    const camera = options.stream === undefined ? await openCamera() : null;
    const visitor = new Visitor(options, document.createElement("video"), camera);
    const { signal } = options;
    signal?.addEventListener("abort", () => visitor.stop());
    try {
      signal?.throwIfAborted();
      await visitor.begin(options.stream ?? (camera as MediaStream));
      signal?.throwIfAborted();
      return visitor;
    } catch (error) {
      visitor.stop();
      throw error;
    }
  }

  /** Learns the neutral face anew, in two seconds. */
  learn(): void {
    this.tracker?.send({ kind: "learn" });
  }

  /** Gives the camera back. */
  stop(): void {
    this.stopped = true;
    this.tracker?.stop();
    this.tracker = null;
    this.video.srcObject = null;
    for (const track of this.camera?.getTracks() ?? []) track.stop();
  }

  private async begin(stream: MediaStream): Promise<void> {
    const { video } = this;
    video.muted = video.playsInline = true;
    video.srcObject = stream;
    await video.play();
    this.tracker = await Tracker.start(this.options.files, this.options.mirror ?? true, {
      channels: (message) => this.take(message),
      loaded: (bytes) => this.options.onProgress?.(bytes),
      failed: (error) => this.end(error),
    });
    for (const track of stream.getVideoTracks()) {
      track.addEventListener("ended", () => this.end(new AvatarError("The camera was taken away; connect it, and start again.")));
    }
    this.watch();
  }

  private take({ seen, ms, channels }: FromTracker & { kind: "channels" }): void {
    this.spare = channels;
    if (this.stopped) return;
    this.seen = seen;
    if (seen === "live") {
      setChannels(this.frame, channels);
      this.frameMs = ms;
    }
    this.options.onFrame?.(this);
  }

  /** Shows the tracker every new picture, but those that come while it looks at another. */
  private readonly watch = (): void => {
    if (this.stopped) return;
    // Not requestVideoFrameCallback: WebKitGTK calls it for no camera.
    if (this.spare !== null && this.video.currentTime !== this.shown) void this.show(this.spare);
    requestAnimationFrame(this.watch);
  };

  private async show(channels: Float32Array<ArrayBuffer>): Promise<void> {
    this.spare = null;
    this.shown = this.video.currentTime;
    const ms = performance.now();
    try {
      const picture = await createImageBitmap(this.video);
      this.tracker?.send({ kind: "picture", picture, ms, channels }, [picture, channels.buffer]);
    } catch {
      this.spare = channels; // there is no picture yet
    }
  }

  private end(error: AvatarError): void {
    if (this.stopped) return;
    const running = this.tracker !== null; // while it starts, `start` throws
    this.stop();
    if (running) this.options.onEnd?.(error);
  }
}
