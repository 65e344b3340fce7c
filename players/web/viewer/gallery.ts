// Tiles of several avatars.
import { byId, bytesText, make } from "./parts/dom.js";
import type { Entry } from "./session.js";

/** The list of avatars; a click opens one in place, and the address says which. */
export class Gallery {
  private readonly root = byId("gallery");
  private readonly viewer = byId("viewer");

  constructor(entries: readonly Entry[], open: (entry: Entry) => void) {
    byId("tiles").replaceChildren(...entries.map((entry) => tile(entry, open)));
  }

  /** Shows the gallery in place of the avatar, or the avatar again. */
  set shown(shown: boolean) {
    this.root.hidden = !shown;
    this.viewer.hidden = shown;
  }

  get shown(): boolean {
    return !this.root.hidden;
  }
}

function tile(entry: Entry, open: (entry: Entry) => void): HTMLElement {
  const link = make("a", { href: `?avatar=${encodeURIComponent(entry.id)}` });
  if (entry.preview !== null) link.append(make("img", { src: entry.preview, alt: "", loading: "lazy" }));
  else link.append(make("span", { class: "no-preview", "aria-hidden": "true" }, entry.name.slice(0, 1).toUpperCase()));
  const facts = [entry.bytes > 0 ? bytesText(entry.bytes) : "", entry.license ?? ""].filter((fact) => fact !== "");
  link.append(make("strong", {}, entry.name), make("small", {}, facts.join(" · ")));
  link.addEventListener("click", (event) => {
    if (event.ctrlKey || event.metaKey || event.shiftKey) return; // a new tab or window
    event.preventDefault();
    open(entry);
  });
  return make("li", {}, link);
}
