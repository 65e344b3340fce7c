// The avatar alone, or with its controls: one quiet button leads from one to the other.
import { byId, setIcon } from "./parts/dom.js";

/** Whether the page presents or inspects. `index.html` begins presenting, so that no control flashes up. */
export class Presenting {
  /** Called after a change. */
  changed: () => void = () => undefined;
  private readonly root = document.documentElement;
  private readonly button = byId("inspect-button");

  constructor() {
    this.button.addEventListener("click", () => {
      this.on = !this.on;
    });
  }

  /** `embedded`: nothing but the avatar, in a frame of another page. */
  begin(on: boolean, embedded: boolean): void {
    this.root.classList.toggle("embedded", embedded);
    this.button.hidden = embedded;
    this.on = on || embedded;
  }

  get on(): boolean {
    return this.root.classList.contains("presenting");
  }

  set on(on: boolean) {
    this.root.classList.toggle("presenting", on);
    this.button.setAttribute("aria-expanded", String(!on));
    setIcon(this.button, on ? "inspect" : "close", on ? "Open the inspector" : "Close the inspector");
    this.changed();
  }
}
