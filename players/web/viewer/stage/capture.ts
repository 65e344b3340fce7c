// A picture or a video of the canvas, saved as a file.
import { AvatarError } from "../../src/index.js";
import { make } from "../parts/dom.js";
import type { Stage } from "../../src/stage/stage.js";

const VIDEO_TYPES = ["video/mp4;codecs=avc1.640033", "video/mp4", "video/webm;codecs=vp9", "video/webm"] as const;
const BITS_A_SECOND = 12e6;

/** Saves bytes under a name. */
export function save(blob: Blob, name: string): void {
  const address = URL.createObjectURL(blob);
  make("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/** A file name without what file systems refuse. */
export function fileName(name: string, ending: string): string {
  return `${name.replace(/[^\p{L}\p{N}._-]+/gu, "_") || "avatar"}.${ending}`;
}

/** Saves the canvas as PNG, in its full size. A transparent background stays transparent. */
export async function takePicture(stage: Stage): Promise<string> {
  await stage.drawn();
  const blob = await new Promise<Blob | null>((done) => stage.element.toBlob(done, "image/png"));
  if (blob === null) throw new AvatarError("the browser gives no picture of the canvas");
  const name = fileName(stage.avatar?.name ?? "avatar", "png");
  save(blob, name);
  return name;
}

/** Records the canvas until it is stopped. */
export class Video {
  private recorder: MediaRecorder | null = null;

  constructor(private readonly stage: Stage) {}

  get recording(): boolean {
    return this.recorder !== null;
  }

  /** Starts. `done` gets the file's name, `failed` what went wrong. */
  start(done: (name: string) => void, failed: (error: unknown) => void): void {
    if (typeof MediaRecorder === "undefined") throw new AvatarError("this browser cannot record a video");
    const type = VIDEO_TYPES.find((kind) => MediaRecorder.isTypeSupported(kind));
    if (type === undefined) throw new AvatarError("this browser can record neither mp4 nor webm");
    const parts: Blob[] = [];
    const stream = this.stage.element.captureStream(60);
    const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: BITS_A_SECOND });
    recorder.addEventListener("dataavailable", (event) => parts.push(event.data));
    recorder.addEventListener("error", () => failed(new AvatarError("the browser stopped recording")));
    recorder.addEventListener("stop", () => {
      this.finish(stream);
      if (parts.every(({ size }) => size === 0)) return failed(new AvatarError("this browser recorded nothing"));
      const name = fileName(this.stage.avatar?.name ?? "avatar", type.startsWith("video/mp4") ? "mp4" : "webm");
      save(new Blob(parts, { type }), name);
      done(name);
    });
    recorder.start(1000);
    this.recorder = recorder;
    this.stage.continuous = true;
    this.stage.ask();
  }

  /** Stops and saves. */
  stop(): void {
    if (this.recorder?.state === "recording") this.recorder.stop();
  }

  private finish(stream: MediaStream): void {
    for (const track of stream.getTracks()) track.stop();
    this.recorder = null;
    this.stage.continuous = false;
  }
}
