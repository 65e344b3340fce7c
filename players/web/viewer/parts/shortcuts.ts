// Which key does what.
import { byId } from "./dom.js";
import type { Clips } from "../motion/clips.js";
import type { Key } from "./keys.js";
import type { LightControls } from "../controls/light.js";
import type { Look } from "../controls/look.js";
import type { Orbit } from "../../src/stage/orbit.js";

const SPEEDUP = 1;

/** What keys act on. */
export interface Shortcuts {
  readonly orbit: Orbit;
  readonly clips: Clips;
  readonly look: Look;
  readonly light: LightControls;
}

/** The table of shortcuts. Those of buttons press the button, so that both do the same. */
export function keysOf({ orbit, clips, look, light }: Shortcuts): readonly Key[] {
  return [
    { keys: [" "], shown: "Space", text: "Play or pause", run: () => clips.toggle() },
    { keys: [",", "."], shown: ", .", text: "Frame back, forward", run: (event) => clips.stepFrames(event.key === "," ? -1 : 1) },
    { keys: ["[", "]"], shown: "[ ]", text: "Slower, faster", run: (event) => clips.changeSpeed(event.key === "[" ? -SPEEDUP : SPEEDUP) },
    { keys: ["n"], shown: "N", text: "Next clip", run: () => clips.next() },
    press(["l"], "L", "Loop", "loop-button"),
    { keys: ["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"], shown: "Arrows", text: "Turn", run: (event) => orbit.press(event.key) },
    { keys: ["+", "=", "-"], shown: "+ −", text: "Zoom", run: (event) => orbit.press(event.key) },
    press(["f"], "F", "Head or whole", "frame-button"),
    { keys: ["r"], shown: "R", text: "Front view", run: () => orbit.frame(orbit.part) },
    press(["Backspace"], "Backspace", "Reset the pose", "reset-button"),
    { keys: ["b"], shown: "B", text: "Next background", run: () => look.next() },
    { keys: ["t"], shown: "T", text: "Next light", run: () => light.next() },
    press(["d"], "D", "Move the light", "light-button"),
    press(["p"], "P", "Save a picture", "photo-button"),
    press(["v"], "V", "Record a video, stop", "video-button"),
    press(["o"], "O", "Open a file", "open-button"),
    press(["k"], "K", "Follow live input", "live-button"),
    press(["i"], "I", "Open or close the inspector", "inspect-button"),
    press(["u"], "U", "Use your camera, stop", "camera-button"),
    press(["c"], "C", "Show or hide controls", "panel-button"),
    { keys: ["/"], shown: "/", text: "Search controls", run: () => openSearch() },
    press(["x"], "X", "Full screen", "full-button"),
    press(["g"], "G", "All avatars", "gallery-button"),
    press(["?", "h"], "?", "Help", "help-button"),
  ];
}

function press(keys: readonly string[], shown: string, text: string, id: string): Key {
  return {
    keys,
    shown,
    text,
    run() {
      const button = byId<HTMLButtonElement>(id);
      if (button.getClientRects().length > 0) button.click(); // one that is not shown does nothing
    },
  };
}

function openSearch(): void {
  const button = byId("panel-button");
  if (button.getClientRects().length === 0) return;
  if (button.getAttribute("aria-expanded") === "false") button.click();
  byId("search").focus();
}
