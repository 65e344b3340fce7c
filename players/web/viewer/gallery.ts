// Tiles of several avatars; exporter/avatar_export/serving/gallery.py writes the same elements for published ones.
import { byId, bytesText, make } from "./parts/dom.js";
import type { Entry } from "./session.js";

const SHORT = 40; // letters; a longer licence stands with the avatar itself

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
  const picture = entry.preview === null ? entry.name.slice(0, 1).toUpperCase() : make("img", { src: entry.preview, alt: "", loading: "lazy" });
  const licence = entry.license !== null && entry.license.length <= SHORT ? entry.license : "";
  const facts = [entry.bytes > 0 ? bytesText(entry.bytes) : "", licence].filter((fact) => fact !== "");
  link.append(make("span", { class: "picture", "aria-hidden": "true" }, picture), make("strong", {}, entry.name), make("small", {}, facts.join(" · ")));
  link.addEventListener("click", (event) => {
    if (event.ctrlKey || event.metaKey || event.shiftKey) return; // a new tab or window
    event.preventDefault();
    open(entry);
  });
  return make("li", {}, link);
}
