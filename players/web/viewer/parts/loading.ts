// Loads one avatar at a time, with its progress, its still picture and a way to cancel.
import { load, type Avatar, type Source } from "../../src/index.js";
import { byId, bytesText, setText } from "./dom.js";

/** The progress bar and the picture that stands for an avatar until it is drawn. */
export class Loading {
  private controller: AbortController | null = null;
  private readonly box = byId("loading");
  private readonly bar = byId<HTMLProgressElement>("progress");
  private readonly text = byId("progress-text");
  private readonly poster = byId<HTMLImageElement>("poster");
  private ownPoster = ""; // a blob address to free
  private given = !this.poster.classList.contains("away"); // a published page has its poster from the start

  constructor() {
    byId("cancel-button").addEventListener("click", () => this.controller?.abort());
    this.poster.addEventListener("error", () => this.hidePoster());
  }

  /** Loads. Returns null where it was cancelled, or overtaken by another. Throws AvatarError for a bad pack. */
  async load(source: Source, name: string): Promise<Avatar | null> {
    this.controller?.abort();
    const controller = new AbortController();
    this.controller = controller;
    this.box.hidden = false;
    this.show(name, 0, null);
    try {
      const avatar = await load(source, {
        name,
        signal: controller.signal,
        onProgress: (loaded, total) => {
          if (this.controller === controller) this.show(name, loaded, total);
        },
      });
      return controller.signal.aborted ? null : avatar;
    } catch (error) {
      if (controller.signal.aborted) return null;
      throw error;
    } finally {
      if (this.controller === controller) {
        this.controller = null;
        this.box.hidden = true;
      }
    }
  }

  /** Shows a still picture over the canvas: an address, or a WebP image; null: none. */
  setPoster(picture: string | Uint8Array | null): void {
    if (this.given) return;
    this.hidePoster();
    if (picture === null) return;
    this.poster.classList.remove("framed");
    if (typeof picture !== "string") {
      this.ownPoster = URL.createObjectURL(new Blob([picture as Uint8Array<ArrayBuffer>], { type: "image/webp" }));
    }
    this.poster.src = typeof picture === "string" ? picture : this.ownPoster;
    this.poster.classList.remove("away");
  }

  /** Takes the still picture away: it fades. */
  hidePoster(): void {
    this.given = false;
    this.poster.classList.add("away");
    if (this.ownPoster !== "") URL.revokeObjectURL(this.ownPoster);
    this.ownPoster = "";
  }

  private show(name: string, loaded: number, total: number | null): void {
    if (total !== null && total > 0) this.bar.value = Math.min(1, loaded / total);
    else this.bar.removeAttribute("value");
    const of = total !== null && total > 0 ? ` of ${bytesText(total)}` : "";
    setText(this.text, loaded > 0 ? `${name}: ${bytesText(loaded)}${of}` : name);
  }
}
