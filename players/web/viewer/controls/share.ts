// The section "Share" of the panel: lines to copy, for a page that lies on a web server.
import type { Entry } from "../session.js";
import { make } from "../parts/dom.js";
import { printable } from "../../src/errors.js";

const COPIED_MS = 1500;

/** Address, frame and tag of the avatar; null for a page that nobody else can reach. */
export function shareSection(entry: Entry): HTMLElement | null {
  if (!/^https?:$/.test(location.protocol) || !/^[^:]*$/.test(entry.file)) return null;
  const page = new URL(".", location.href).href;
  const name = quoted(printable(entry.name));
  const frame = `<iframe src="${quoted(page)}index.html?embed" title="${name}" style="border: 0; width: 100%; aspect-ratio: 4 / 5" allow="fullscreen" loading="lazy"></iframe>`;
  const tag = `<gaussian-avatar src="${quoted(new URL(entry.file, location.href).href)}"></gaussian-avatar>`;
  return make(
    "details",
    { class: "section", id: "share" },
    make("summary", {}, make("span", {}, "Share")),
    line("Link", page),
    line("In a page", frame),
    line("With avatar-export-player", tag),
  );
}

function quoted(text: string): string {
  return text.replaceAll("&", "&amp;").replaceAll('"', "&quot;").replaceAll("<", "&lt;");
}

function line(label: string, text: string): HTMLElement {
  const field = make("input", { type: "text", readonly: true, value: text });
  const button = make("button", { class: "text", "aria-label": `Copy: ${label}` }, "Copy");
  field.addEventListener("focus", () => field.select());
  button.addEventListener("click", () => void copy(field, button));
  return make("div", { class: "share" }, make("label", {}, make("span", {}, label), field), button);
}

async function copy(field: HTMLInputElement, button: HTMLButtonElement): Promise<void> {
  try {
    await navigator.clipboard.writeText(field.value);
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = "Copy"), COPIED_MS);
  } catch {
    field.select(); // plain http has no clipboard: the keys copy what is selected
  }
}
