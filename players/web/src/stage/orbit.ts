// The camera's path around a target: mouse, wheel, touch and keys. Nothing is allocated while it moves.
import type { Framing } from "../avatar.js";
import type { Camera } from "../camera.js";

const TANGENT = Math.tan((15 * Math.PI) / 180); // half of what is framed, by its distance: a portrait lens, so faces look natural
const MARGIN = 1.12; // room around what is framed
const TURN = 2.2 * Math.PI; // radians for a drag across the smaller side
const MOST_PITCH = (88 * Math.PI) / 180;
const DECAY_MS = 120; // inertia falls to 1/e in this time
const KEY_TURN = (5 * Math.PI) / 180; // a press of an arrow key
const KEY_ZOOM = 1.1;
const KEYS: Readonly<Record<string, readonly [yaw: number, pitch: number, zoom: number]>> = {
  ArrowLeft: [-KEY_TURN, 0, 1],
  ArrowRight: [KEY_TURN, 0, 1],
  ArrowUp: [0, KEY_TURN, 1],
  ArrowDown: [0, -KEY_TURN, 1],
  "+": [0, 0, 1 / KEY_ZOOM],
  "=": [0, 0, 1 / KEY_ZOOM],
  "-": [0, 0, KEY_ZOOM],
};

type Vector = readonly number[]; // [3]

/**
 * What a hand can do with the view: all; "page": all but what moves the page around it, the wheel and one finger that
 * goes up or down; nothing.
 */
export type Controls = "all" | "page" | "none";

/** Which part of the avatar is framed. */
export type Part = "head" | "whole";

function cross(a: Vector, b: Vector): Vector {
  const [ax = 0, ay = 0, az = 0] = a;
  const [bx = 0, by = 0, bz = 0] = b;
  return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx];
}

/** An orbit camera. Angles in radians, lengths in metres; yaw 0 looks at the avatar's front. */
export class Orbit {
  yaw = 0;
  pitch = 0;
  distance = 1;
  part: Part = "whole";
  controls: Controls = "all";
  /** Of the image, pixels. */
  width = 1;
  height = 1;
  /** Takes the drags that turn the view otherwise, in radians to the right and downwards. */
  dragged: ((x: number, y: number) => void) | null = null;
  /** Called where the camera moved by hand. */
  moved: () => void = () => undefined;

  private readonly target = new Float64Array(3);
  private readonly view = new Float64Array(9); // camera from world, rows right, down, forward
  private readonly translation = new Float64Array(3);
  private readonly intrinsics = new Float64Array(9);
  private right: Vector = [1, 0, 0];
  private up: Vector = [0, 1, 0];
  private front: Vector = [0, 0, 1];
  private framing: Framing | null = null;
  private size: Vector = [1, 1, 1]; // metres, of what was framed
  private scale = 1; // metres: size of what was framed
  private readonly still = matchMedia("(prefers-reduced-motion: reduce)");

  private firstId = -1;
  private secondId = -1;
  private readonly at = new Float64Array(4); // x, y of both pointers, CSS pixels
  private panning = false;
  private yawSpeed = 0; // radians a millisecond
  private pitchSpeed = 0;
  private lastMove = 0;
  private lastStep = 0;

  /** Takes over the framing of another avatar. The view stays where `keep` is true and the axes are the same. */
  setFraming(framing: Framing, keep: boolean): void {
    const first = this.framing === null;
    this.framing = framing;
    this.up = framing.up;
    this.front = framing.front;
    this.right = cross(framing.up, framing.front);
    if (first || !keep) {
      // A head fills most of a head avatar; a body is shown whole.
      const head = framing.head;
      this.frame(head !== null && framing.whole.size[1] < 2.5 * head.size[1] ? "head" : "whole");
    }
  }

  /** True where head and whole are different views. */
  get hasHead(): boolean {
    return this.framing?.head != null;
  }

  /** Looks at the front of the head or of the whole avatar. */
  frame(part: Part): void {
    const framing = this.framing;
    if (framing === null) return;
    const box = part === "head" && framing.head !== null ? framing.head : framing.whole;
    this.part = framing.head === null ? "whole" : part;
    this.target.set(box.target);
    this.yaw = 0;
    this.pitch = 0;
    this.stop();
    this.size = box.size.map((side) => Math.max(side, 1e-6));
    this.scale = Math.max(...this.size);
    this.fit();
    this.moved();
  }

  /** The image has another size, in pixels. What was framed stays framed. */
  resize(width: number, height: number): void {
    this.width = width;
    this.height = height;
  }

  /** In every window the same perspective: what is framed looks like one picture that is shown larger or smaller. */
  private fit(): void {
    const [across = 1, tall = 1, deep = 1] = this.size;
    this.distance = (MARGIN * Math.max(across, tall)) / 2 / TANGENT + deep / 2;
  }

  /** In pixels. */
  private get focal(): number {
    const [across = 1, tall = 1] = this.size;
    return (Math.max(across, tall) * Math.min(this.height / tall, this.width / across)) / 2 / TANGENT;
  }

  /** Shows the other part. */
  toggle(): void {
    this.frame(this.part === "head" ? "whole" : "head");
  }

  /** Turns by angles in radians. */
  turn(yaw: number, pitch: number): void {
    this.yaw += yaw;
    this.pitch = Math.min(MOST_PITCH, Math.max(-MOST_PITCH, this.pitch + pitch));
    this.moved();
  }

  /** Multiplies the distance. */
  zoom(factor: number): void {
    this.distance = Math.min(20 * this.scale, Math.max(0.02 * this.scale, this.distance * factor));
    this.moved();
  }

  /** Arrow keys turn, plus and minus zoom, Home shows the front. False for another key. */
  press(key: string): boolean {
    if (key === "Home") this.frame(this.part);
    const step = KEYS[key];
    if (step === undefined) return key === "Home";
    this.turn(step[0], step[1]);
    if (step[2] !== 1) this.zoom(step[2]);
    return true;
  }

  /** Metres of a CSS pixel at the target; `pixels` is the canvas's height in CSS pixels. */
  metresAcross(pixels: number): number {
    return (this.distance / this.focal) * (this.height / pixels);
  }

  /** Moves the picture by CSS pixels; `pixels` is the canvas's height in CSS pixels. */
  pan(x: number, y: number, pixels: number): void {
    const metres = this.metresAcross(pixels);
    this.turnAxes();
    for (let i = 0; i < 3; i++) this.target[i]! -= metres * (x * this.view[i]! + y * this.view[3 + i]!);
    this.moved();
  }

  /** Goes on turning after a swipe. True while it moves. */
  step(nowMs: number): boolean {
    const past = Math.min(50, nowMs - this.lastStep);
    this.lastStep = nowMs;
    if (this.firstId !== -1 || (this.yawSpeed === 0 && this.pitchSpeed === 0)) return false;
    this.yaw += this.yawSpeed * past;
    this.pitch = Math.min(MOST_PITCH, Math.max(-MOST_PITCH, this.pitch + this.pitchSpeed * past));
    const left = Math.exp(-past / DECAY_MS);
    this.yawSpeed *= left;
    this.pitchSpeed *= left;
    if (Math.abs(this.yawSpeed) + Math.abs(this.pitchSpeed) < 2e-5) this.stop();
    return true;
  }

  private stop(): void {
    this.yawSpeed = 0;
    this.pitchSpeed = 0;
  }

  /** Listens to mouse, touch, pen and wheel on the canvas. */
  listen(canvas: HTMLElement): void {
    canvas.addEventListener("pointerdown", (event) => this.down(canvas, event));
    canvas.addEventListener("pointermove", (event) => this.move(canvas, event));
    canvas.addEventListener("pointerup", (event) => this.release(event));
    canvas.addEventListener("pointercancel", (event) => {
      this.release(event);
      this.stop(); // the page moves on
    });
    canvas.addEventListener("contextmenu", (event) => {
      if (this.controls === "all") event.preventDefault();
    });
    canvas.addEventListener("dblclick", () => {
      if (this.controls !== "none") this.frame(this.part);
    });
    canvas.addEventListener(
      "wheel",
      (event) => {
        if (this.controls === "none" || (this.controls === "page" && !event.ctrlKey)) return;
        event.preventDefault();
        const lines = event.deltaMode === 0 ? 1 : event.deltaMode === 1 ? 20 : 400;
        // A pinch on a touchpad arrives as a wheel with Ctrl and small steps.
        const step = Math.min(200, Math.max(-200, event.deltaY * lines)) * (event.ctrlKey ? 0.008 : 0.0015);
        this.zoom(Math.exp(step));
      },
      { passive: false },
    );
  }

  private down(canvas: HTMLElement, event: PointerEvent): void {
    if (this.controls === "none" || (this.firstId !== -1 && event.pointerType === "mouse")) return;
    if (this.controls === "page" && event.button === 2) return; // the browser's own menu
    canvas.setPointerCapture(event.pointerId);
    if (this.firstId === -1) {
      this.firstId = event.pointerId;
      this.panning = event.button !== 0 || event.shiftKey || event.ctrlKey || event.metaKey;
      this.at[0] = event.clientX;
      this.at[1] = event.clientY;
    } else if (this.secondId === -1) {
      this.secondId = event.pointerId;
      this.at[2] = event.clientX;
      this.at[3] = event.clientY;
    }
    this.stop();
  }

  private move(canvas: HTMLElement, event: PointerEvent): void {
    const slot = event.pointerId === this.firstId ? 0 : event.pointerId === this.secondId ? 2 : -1;
    if (slot === -1) return;
    const at = this.at;
    const x = event.clientX - at[slot]!;
    const y = event.clientY - at[slot + 1]!;
    const apart = Math.hypot(at[0]! - at[2]!, at[1]! - at[3]!);
    at[slot] = event.clientX;
    at[slot + 1] = event.clientY;
    if (this.secondId !== -1) {
      this.pan(x / 2, y / 2, canvas.clientHeight); // each finger moves the picture by half
      this.zoom(apart / Math.max(1, Math.hypot(at[0]! - at[2]!, at[1]! - at[3]!)));
    } else if (this.panning) {
      this.pan(x, y, canvas.clientHeight);
    } else {
      const radians = TURN / Math.max(200, Math.min(canvas.clientWidth, canvas.clientHeight)) / 2;
      if (this.dragged !== null) {
        this.dragged(x * radians, y * radians);
        return;
      }
      const past = Math.max(1, event.timeStamp - this.lastMove);
      const tilt = this.controls === "page" && event.pointerType === "touch" ? 0 : y * radians; // that moves the page
      this.yawSpeed = (-x * radians) / past;
      this.pitchSpeed = tilt / past;
      this.turn(-x * radians, tilt);
    }
    this.lastMove = event.timeStamp;
  }

  private release(event: PointerEvent): void {
    if (event.pointerId === this.secondId) {
      this.secondId = -1;
    } else if (event.pointerId === this.firstId) {
      this.firstId = this.secondId; // the other finger goes on
      this.secondId = -1;
      this.at.copyWithin(0, 2);
    } else {
      return;
    }
    const held = event.timeStamp - this.lastMove > 40;
    if (held || this.still.matches || this.panning || this.firstId !== -1) this.stop();
    this.moved();
  }

  /** Writes the view into a camera. */
  place(camera: Camera): void {
    this.turnAxes();
    const { view, translation, intrinsics, width, height } = this;
    for (let row = 0; row < 3; row++) {
      let along = row === 2 ? this.distance : 0;
      for (let i = 0; i < 3; i++) along -= view[3 * row + i]! * this.target[i]!;
      translation[row] = along;
    }
    intrinsics[0] = intrinsics[4] = this.focal;
    intrinsics[2] = width / 2;
    intrinsics[5] = height / 2;
    intrinsics[8] = 1;
    camera.fromOpencv(view, translation, intrinsics, width, height);
  }

  /** Rotation of the view: rows right, down, forward, in the world. */
  private turnAxes(): void {
    const cosYaw = Math.cos(this.yaw);
    const sinYaw = Math.sin(this.yaw);
    const cosPitch = Math.cos(this.pitch);
    const sinPitch = Math.sin(this.pitch);
    for (let i = 0; i < 3; i++) {
      const away = cosYaw * this.front[i]! + sinYaw * this.right[i]!;
      this.view[i] = cosYaw * this.right[i]! - sinYaw * this.front[i]!;
      this.view[3 + i] = sinPitch * away - cosPitch * this.up[i]!;
      this.view[6 + i] = -cosPitch * away - sinPitch * this.up[i]!;
    }
  }
}
