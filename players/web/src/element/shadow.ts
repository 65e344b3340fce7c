// What is inside the element: the picture's place, the poster, the loading bar, and the words where there is no picture.
import { printable } from "../errors.js";

const STYLE = `
:host { display: block; position: relative; aspect-ratio: 1; overflow: hidden; contain: content; }
:host([hidden]) { display: none; }
#stage, canvas, img { position: absolute; inset: 0; width: 100%; height: 100%; }
canvas { object-fit: contain; user-select: none; -webkit-user-select: none; outline-offset: -3px; }
canvas[role=application] { cursor: grab; }
canvas[role=application]:active { cursor: grabbing; }
img { object-fit: contain; pointer-events: none; }
#bar { position: absolute; inset: auto 0 0; height: 3px; transform-origin: 0 0; background: currentColor; opacity: 0.6; }
#alert { position: absolute; inset: 0; display: grid; place-items: center; overflow: auto; container-type: size; }
#alert p { box-sizing: border-box; margin: 0; max-width: min(30em, 92%); padding: 0.8em 1.2em; border-radius: 0.6em; text-align: center; }
#alert p { color: #fff; background: #18181be6; font: 14px/1.4 system-ui, sans-serif; overflow-wrap: anywhere; }
#alert small { display: block; margin-top: 0.4em; color: #d4d4d8; }
@container (max-width: 200px) or (max-height: 120px) { #alert p { padding: 0.3em 0.5em; font-size: 12px; } #alert small { display: none; } }
[hidden] { display: none !important; }
`;

let sheet: CSSStyleSheet | undefined; // adopted: strict pages allow no style elements

/** The parts of one element. */
export class Shadow {
  readonly stage = part("div", "stage");
  private readonly poster = part("img", "poster");
  private readonly bar = part("div", "bar");
  private readonly alert = part("div", "alert");
  private ownPoster = ""; // an address of a blob to free

  constructor(host: HTMLElement) {
    const root = host.attachShadow({ mode: "open", delegatesFocus: true });
    sheet ??= makeSheet();
    root.adoptedStyleSheets = [sheet];
    this.poster.alt = "";
    this.bar.setAttribute("role", "progressbar");
    this.bar.setAttribute("aria-label", "Loading");
    this.alert.setAttribute("role", "alert");
    this.poster.addEventListener("error", () => this.setPoster(null));
    this.setPoster(null);
    this.setProgress(null);
    this.setError(null);
    root.append(this.stage, this.poster, this.bar, this.alert);
  }

  get hasPoster(): boolean {
    return !this.poster.hidden;
  }

  /** Shows a still picture over the canvas: an address, or a WebP image; null: none. */
  setPoster(picture: string | Uint8Array | null): void {
    if (this.ownPoster !== "") URL.revokeObjectURL(this.ownPoster);
    const own = picture !== null && typeof picture !== "string";
    this.ownPoster = own ? URL.createObjectURL(new Blob([picture as Uint8Array<ArrayBuffer>], { type: "image/webp" })) : "";
    this.poster.hidden = picture === null;
    if (picture === null) this.poster.removeAttribute("src");
    else this.poster.src = own ? this.ownPoster : picture;
  }

  /** How much has been loaded, 0 to 1; NaN: not known; null: nothing is loading. */
  setProgress(share: number | null): void {
    this.bar.hidden = share === null;
    if (share === null || Number.isNaN(share)) this.bar.removeAttribute("aria-valuenow");
    else this.bar.setAttribute("aria-valuenow", String(Math.round(100 * share)));
    this.bar.style.transform = `scaleX(${share === null || Number.isNaN(share) ? 1 : share})`;
  }

  /** Tells a visitor that there is nothing to see, and why; null: takes it away. */
  setError(reason: string | null): void {
    this.alert.hidden = reason === null;
    if (reason === null) {
      this.alert.replaceChildren();
      return;
    }
    const words = document.createElement("p");
    const small = document.createElement("small");
    small.textContent = printable(reason);
    words.append("This avatar cannot be shown.", small);
    this.alert.replaceChildren(words);
  }
}

function part<K extends "div" | "img">(tag: K, name: string): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  element.id = name;
  element.setAttribute("part", name);
  return element;
}

function makeSheet(): CSSStyleSheet {
  const made = new CSSStyleSheet();
  made.replaceSync(STYLE);
  return made;
}
