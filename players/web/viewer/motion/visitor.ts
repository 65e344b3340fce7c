// The visitor's camera drives the avatar: the button, what the tracker sees, and the recording.
import { type Addresses, FaceRecorder, liveLinkCsv, NOT_SEEN, SEEN_BADLY, Visitor } from "../../src/visitor.js";
import type { ArkitInputs } from "../controls/channels.js";
import { byId, errorText, make, setText } from "../parts/dom.js";
import { fileName, save } from "../stage/capture.js";

const STATES = {
  learning: "Look straight ahead and relax…",
  live: "Follows your face",
  away: "No face is seen",
} as const;

/** The page around it. */
export interface VisitorHost {
  /** What can be driven; null: nothing. */
  inputs(): ArkitInputs | null;
  /** The visitor takes over from clips, sliders and live input. */
  began(): void;
  /** The visitor is gone. */
  ended(): void;
  /** A frame is needed. */
  ask(): void;
  note(text: string): void;
  error(text: string): void;
}

/** The visitor's controls. */
export class VisitorControls {
  private files: Addresses | null = null;
  private visitor: Visitor | null = null;
  private starting: AbortController | null = null;
  private recorder: FaceRecorder | null = null;
  private readonly button = byId<HTMLButtonElement>("camera-button");
  private readonly state = make("p", { role: "status" });
  private readonly record = make("button", { class: "text", "aria-pressed": "false" }, "Record");
  private readonly again = make("button", { class: "text", title: "Learn your face at rest again" }, "Relearn");
  private readonly mirror = make("div", { class: "mirror", "aria-hidden": "true" });
  private readonly limits = make(
    "details",
    {},
    make("summary", {}, "What is seen"),
    make("p", {}, `No picture leaves this page. Not seen: ${sides(NOT_SEEN)}. Seen badly: ${sides(SEEN_BADLY)}.`),
  );
  private readonly box = make(
    "section",
    { id: "visitor", "aria-label": "Your camera", hidden: true },
    this.mirror,
    this.state,
    this.again,
    this.record,
    this.limits,
  );

  constructor(private readonly host: VisitorHost) {
    byId("view").append(this.box);
    this.button.addEventListener("click", () => (this.on ? this.leave() : void this.start()));
    this.again.addEventListener("click", () => this.visitor?.learn());
    this.record.addEventListener("click", () => this.toggleRecord());
  }

  /** Offers the camera where the tracker's files are; null: it is not offered. */
  offer(files: Addresses | null): void {
    this.files = files;
    this.button.hidden = files === null;
  }

  /** Whether the visitor moves the avatar. */
  get on(): boolean {
    return this.visitor !== null || this.starting !== null;
  }

  /** Gives the camera back. */
  stop(): void {
    if (!this.on) return;
    if (this.recorder !== null) this.toggleRecord();
    this.visitor?.stop();
    this.visitor = null;
    this.starting?.abort();
    this.starting = null;
    this.show();
  }

  /** Gives the camera back, and the avatar its own pose. */
  leave(): void {
    if (!this.on) return;
    this.stop();
    this.host.ended();
  }

  private async start(): Promise<void> {
    if (this.files === null) return;
    if (this.host.inputs() === null) return this.host.error("ARKit names cannot drive this avatar, so a camera cannot.");
    const controller = (this.starting = new AbortController());
    const { signal } = controller;
    this.show();
    setText(this.state, "Asks for your camera");
    try {
      const visitor = await Visitor.start({
        files: this.files,
        signal,
        onProgress: (bytes) => setText(this.state, `Loads the face tracker, ${(bytes / 1e6).toFixed(1)} MB`),
        onFrame: () => this.frame(),
        onEnd: (error) => this.failed(error),
      });
      this.starting = null;
      this.visitor = visitor;
      this.mirror.replaceChildren(visitor.video);
      this.host.began();
    } catch (error) {
      if (!signal.aborted) this.failed(error);
    }
  }

  private failed(error: unknown): void {
    this.leave();
    this.host.error(errorText(error));
  }

  private frame(): void {
    const { visitor } = this;
    if (visitor === null) return;
    setText(this.state, STATES[visitor.seen]);
    if (visitor.seen !== "live") return;
    this.recorder?.add(visitor.frame, visitor.frameMs);
    const inputs = this.host.inputs();
    if (inputs === null) return;
    inputs.take(visitor.frame);
    inputs.apply();
    this.host.ask();
  }

  private show(): void {
    this.box.hidden = !this.on;
    this.button.setAttribute("aria-pressed", String(this.on));
    this.button.setAttribute("aria-label", this.on ? "Stop your camera" : "Use your camera");
    this.mirror.replaceChildren();
  }

  private toggleRecord(): void {
    const { recorder } = this;
    this.recorder = recorder === null ? new FaceRecorder() : null;
    this.record.setAttribute("aria-pressed", String(recorder === null));
    setText(this.record, recorder === null ? "Stop recording" : "Record");
    if (recorder === null || recorder.frames === 0) return;
    const name = fileName("face", "csv");
    save(new Blob([liveLinkCsv(recorder.recording())], { type: "text/csv" }), name);
    this.host.note(`Saved ${name}: drop it on any avatar`);
  }
}

/** Names as text, both sides as one. */
function sides(names: readonly string[]): string {
  return [...new Set(names.map((name) => name.replace(/(Left|Right)$/, "")))].join(", ");
}
