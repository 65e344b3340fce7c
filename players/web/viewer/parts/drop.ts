// Files that a person drops, pastes or picks: an avatar or a recording, distinguished by their content.
import { AvatarError } from "../../src/index.js";
import { byId } from "./dom.js";

const GZIP = [0x1f, 0x8b] as const;
const MOST_RECORDING_BYTES = 256 * 2 ** 20;

/** What is done with files. */
export interface FileEvents {
  avatar(file: File): void;
  /** The text of a CSV or JSON file. */
  recording(name: string, text: string): void;
  failed(error: unknown): void;
}

/** Listens to drops anywhere on the page, and to the file button. */
export function listenForFiles(events: FileEvents): void {
  const overlay = byId("drop");
  const input = byId<HTMLInputElement>("file");
  const hide = (): void => {
    overlay.hidden = true;
  };
  addEventListener("dragover", (event) => {
    event.preventDefault();
    overlay.hidden = false;
  });
  addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) hide();
  });
  addEventListener("drop", (event) => {
    event.preventDefault();
    hide();
    void take([...(event.dataTransfer?.files ?? [])], events);
  });
  byId("open-button").addEventListener("click", () => input.click());
  input.addEventListener("change", () => {
    const files = [...(input.files ?? [])];
    input.value = ""; // the same file may be picked again
    void take(files, events);
  });
}

/** Avatars first, so that a recording dropped together with one drives it. */
async function take(files: readonly File[], events: FileEvents): Promise<void> {
  const recordings: File[] = [];
  for (const file of files) {
    try {
      const head = new Uint8Array(await file.slice(0, 2).arrayBuffer());
      if (head[0] === GZIP[0] && head[1] === GZIP[1]) events.avatar(file);
      else recordings.push(file);
    } catch (error) {
      events.failed(error);
    }
  }
  for (const file of recordings) {
    try {
      if (file.size > MOST_RECORDING_BYTES) throw new AvatarError("is too large for a recording", { owner: file.name });
      const text = await file.text();
      if (text.includes("\0")) {
        throw new AvatarError("is neither an avatar (.avatar) nor a recording (.csv, .json)", { owner: file.name });
      }
      events.recording(file.name, text);
    } catch (error) {
      events.failed(error);
    }
  }
}
