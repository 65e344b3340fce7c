// The buttons that save a picture and record a video.
import type { Stage } from "../../src/stage/stage.js";
import { byId, errorText } from "../parts/dom.js";
import type { Messages } from "../parts/messages.js";
import { takePicture, Video } from "./capture.js";

/** Saves what the stage shows, and says so. */
export class Saving {
  private readonly video: Video;
  private readonly button = byId("video-button");

  constructor(
    private readonly stage: Stage,
    private readonly messages: Messages,
  ) {
    this.video = new Video(stage);
    byId("photo-button").addEventListener("click", () => void this.takePicture());
    this.button.addEventListener("click", () => this.toggleVideo());
  }

  /** Ends and saves a video. */
  stop(): void {
    this.video.stop();
  }

  private async takePicture(): Promise<void> {
    if (this.stage.instance === null) return;
    try {
      this.messages.note(`Saved ${await takePicture(this.stage)}`);
    } catch (error) {
      this.messages.error(errorText(error));
    }
  }

  private toggleVideo(): void {
    if (this.video.recording) return this.stop();
    if (this.stage.instance === null) return;
    try {
      this.video.start(
        (name) => this.stopped(() => this.messages.note(`Saved ${name}`)),
        (error) => this.stopped(() => this.messages.error(errorText(error))),
      );
      this.button.setAttribute("aria-pressed", "true");
    } catch (error) {
      this.messages.error(errorText(error));
    }
  }

  private stopped(say: () => void): void {
    this.button.setAttribute("aria-pressed", "false");
    say();
  }
}
