// Messages in the page: read aloud, dismissed by a button, errors stay.
import { make, setText } from "./dom.js";

/** A button inside a message. */
export interface MessageAction {
  readonly label: string;
  readonly run: () => void;
}

const NOTE_MS = 5000;
const MOST = 3; // older messages make room

/** The page's messages. Equal texts are shown once. */
export class Messages {
  private readonly notes = make("div", { role: "status", "aria-live": "polite" });
  private readonly kept = make("p", { class: "message note", role: "status", hidden: true });
  private readonly errors = make("div", { role: "alert" });

  constructor(parent: Element) {
    parent.append(this.errors, this.notes, this.kept);
  }

  /** Says something that passes after five seconds. */
  note(text: string): void {
    const entry = this.add(this.notes, "note", text);
    setTimeout(() => entry.remove(), NOTE_MS);
  }

  /** Keeps one line of somebody else on the page, in place of the one before; "" takes it away. */
  status(text: string): void {
    this.kept.hidden = text === "";
    setText(this.kept, text);
  }

  /** Says something that stays until it is dismissed, its action is taken or `clear` is called. */
  error(text: string, action?: MessageAction): void {
    this.add(this.errors, "error", text, action);
  }

  /** Removes all errors. */
  clear(): void {
    this.errors.replaceChildren();
  }

  private add(list: HTMLElement, kind: string, text: string, action?: MessageAction): HTMLElement {
    for (const old of [...list.children]) if (old.firstElementChild?.textContent === text) old.remove();
    while (list.children.length >= MOST) list.firstElementChild?.remove();
    const entry = make("div", { class: `message ${kind}` }, make("p", {}, text));
    if (action !== undefined) {
      const button = make("button", { class: "text" }, action.label);
      button.addEventListener("click", () => {
        entry.remove();
        action.run();
      });
      entry.append(button);
    }
    const close = make("button", { class: "close", "aria-label": "Dismiss" }, "×");
    close.addEventListener("click", () => entry.remove());
    entry.append(close);
    list.append(entry);
    return entry;
  }
}
