// Keys: one table that is both obeyed and shown in the help.
import { make } from "./dom.js";

/** A shortcut. `keys` are values of KeyboardEvent.key, lower case. */
export interface Key {
  readonly keys: readonly string[];
  readonly shown: string; // what the help calls the keys
  readonly text: string; // what they do
  run(event: KeyboardEvent): void;
}

/** Obeys the table, except where a person types or an element uses the key itself. */
export function listenForKeys(keys: readonly Key[]): void {
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    if (document.querySelector("dialog[open]") !== null) return;
    const pressed = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (usesKey(event.target, pressed)) return;
    const key = keys.find((entry) => entry.keys.includes(pressed));
    if (key === undefined) return;
    event.preventDefault();
    key.run(event);
  });
}

/** True where the focused element needs the key for itself. */
function usesKey(target: EventTarget | null, key: string): boolean {
  if (!(target instanceof HTMLElement)) return false;
  if (target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement) return true;
  if (target instanceof HTMLInputElement) {
    if (target.type !== "range") return true;
    return /^(Arrow|Page|Home|End|Backspace|Delete)/.test(key);
  }
  const presses = target instanceof HTMLButtonElement || target.tagName === "SUMMARY" || target.tagName === "A";
  return presses && (key === " " || key === "Enter");
}

/** Writes the table into the help. */
export function showKeys(table: HTMLElement, keys: readonly Key[]): void {
  for (const key of keys) {
    table.append(make("tr", {}, make("th", { scope: "row" }, make("kbd", {}, key.shown)), make("td", {}, key.text)));
  }
}
