// The section "Light" of the panel, the button that lets a drag move the light, and the sun that shows where it is.
import type { Avatar, DirectLight, Light } from "../../src/index.js";
import { PRESETS } from "../../src/light/asked.js";
import type { Stage } from "../../src/stage/stage.js";
import { byId, make, setText } from "../parts/dom.js";

const AS_TRAINED = "As trained";
const FIRST = "studio"; // where the button finds none
const RADIANS = Math.PI / 180;
const MOST_HEIGHT = 89; // degrees
const SUN = 44; // per cent of the smaller side of the view: how far the sun goes from its middle

/** Angles of a direction in degrees: around the vertical, 0 where the face looks and 90 at the person's left; above the horizon. */
interface Angles {
  around: number;
  height: number;
}

/** Choice of a light, and where it comes from. The page shows it only where the light of a scene can replace that of the capture. */
export class LightControls {
  readonly element: HTMLDetailsElement;
  private readonly preset = make("select", { id: "light" });
  private readonly around: Dial;
  private readonly height: Dial;
  private readonly button = byId("light-button");
  private readonly sun = byId("sun");
  private light: Light | null = null;
  private angles: Angles[] = []; // of each light from a direction
  private can = false;
  private front = 1; // the sign of the first light before the camera, when the drag began
  private draggedMs = 0;

  constructor(private readonly stage: Stage) {
    this.preset.append(...[AS_TRAINED, ...Object.keys(PRESETS)].map((name) => make("option", { value: name }, titled(name))));
    this.around = new Dial("Around", 180, (by) => this.turn(by, 0));
    this.height = new Dial("Height", MOST_HEIGHT, (by) => this.turn(0, by));
    this.element = make(
      "details",
      { class: "section", id: "lights", open: true },
      make("summary", {}, make("span", {}, "Light")),
      make("label", { class: "row choice" }, make("span", {}, "Preset"), this.preset),
      this.around.element,
      this.height.element,
    );
    this.preset.addEventListener("change", () => this.choose(this.preset.value));
    this.button.addEventListener("click", () => this.setDragging(this.stage.orbit.dragged === null));
  }

  /** Keeps the chosen light where the avatar can have it. */
  setAvatar(avatar: Avatar): void {
    this.can = avatar.relight !== null;
    this.button.hidden = !this.can;
    if (this.can) this.apply();
    else this.setDragging(false);
  }

  /** The next preset of the list. */
  next(): void {
    if (!this.can) return;
    this.preset.selectedIndex = (this.preset.selectedIndex + 1) % this.preset.options.length;
    this.choose(this.preset.value);
  }

  /** Moves the sun to where the first light is now. */
  showSun(): void {
    const [first] = this.angles;
    this.sun.hidden = first === undefined || this.stage.orbit.dragged === null;
    if (first === undefined || this.sun.hidden) return;
    const [right, up, back] = this.seen(first);
    this.sun.style.translate = `calc(${right * SUN}cqmin - 50%) calc(${-up * SUN}cqmin - 50%)`;
    this.sun.classList.toggle("behind", back < 0);
  }

  private choose(name: string): void {
    this.light = PRESETS[name] ?? null;
    this.angles = (this.light?.lights ?? []).flatMap((one) => ("direction" in one ? [anglesOf(one.direction)] : []));
    if (this.light === null) this.setDragging(false);
    this.apply();
  }

  private setDragging(on: boolean): void {
    const { orbit } = this.stage;
    orbit.dragged = on ? (x, y) => this.drag(x, y) : null;
    this.button.setAttribute("aria-pressed", String(on));
    if (on && this.light === null) {
      this.preset.value = FIRST;
      this.choose(FIRST);
    }
    this.showSun();
  }

  /** Radians to the right and downwards, as the viewer sees it. */
  private drag(x: number, y: number): void {
    const now = performance.now();
    const [first] = this.angles;
    if (first !== undefined && now - this.draggedMs > 300) this.front = this.seen(first)[2] < 0 ? -1 : 1; // it goes with the hand
    this.draggedMs = now;
    this.turn((this.front * x) / RADIANS, -y / RADIANS);
  }

  /** Turns all lights together, by degrees. */
  private turn(around: number, height: number): void {
    for (const one of this.angles) {
      one.around = ((((one.around + around + 180) % 360) + 360) % 360) - 180;
      one.height = Math.max(-MOST_HEIGHT, Math.min(MOST_HEIGHT, one.height + height));
    }
    this.apply();
  }

  private apply(): void {
    const { light, angles } = this;
    const lights = (light?.lights ?? []).map((one, k): DirectLight => {
      const at = angles[k];
      return at === undefined ? one : { direction: directionOf(at), colour: one.colour };
    });
    if (this.can) this.stage.light = light && { ...light, lights };
    const [first] = angles;
    this.around.show(first?.around);
    this.height.show(first?.height);
    this.showSun();
  }

  /** A direction as the camera sees it: to the right, up, towards it. */
  private seen(at: Angles): [right: number, up: number, back: number] {
    const [x, y, z] = directionOf(at);
    const { yaw, pitch } = this.stage.orbit;
    const right = x * Math.cos(yaw) - z * Math.sin(yaw);
    const away = x * Math.sin(yaw) + z * Math.cos(yaw);
    return [right, y * Math.cos(pitch) - away * Math.sin(pitch), away * Math.cos(pitch) + y * Math.sin(pitch)];
  }
}

/** One angle as a slider, which turns all lights by what it is moved. */
class Dial {
  readonly element: HTMLElement;
  private readonly input: HTMLInputElement;
  private readonly output = make("output");
  private shown = 0;

  constructor(label: string, most: number, turn: (by: number) => void) {
    this.input = make("input", { type: "range", min: -most, max: most, step: 1, "aria-label": `Light, ${label.toLowerCase()}` });
    this.element = make("label", { class: "row" }, make("span", {}, label), this.input, this.output);
    this.input.addEventListener("input", () => turn(this.input.valueAsNumber - this.shown));
  }

  /** undefined: there is no light from a direction. */
  show(degrees: number | undefined): void {
    this.element.hidden = degrees === undefined;
    if (degrees === undefined) return;
    this.shown = degrees;
    this.input.value = String(Math.round(degrees));
    const text = `${Math.round(degrees)}°`;
    setText(this.output, text);
    this.input.setAttribute("aria-valuetext", text);
  }
}

function titled(name: string): string {
  return name.charAt(0).toUpperCase() + name.slice(1);
}

function anglesOf([x, y, z]: readonly [number, number, number]): Angles {
  return { around: Math.atan2(x, z) / RADIANS, height: Math.atan2(y, Math.hypot(x, z)) / RADIANS };
}

function directionOf({ around, height }: Angles): [number, number, number] {
  const level = Math.cos(height * RADIANS);
  return [level * Math.sin(around * RADIANS), Math.sin(height * RADIANS), level * Math.cos(around * RADIANS)];
}
