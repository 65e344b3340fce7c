// Where the pointer is, as a direction of the avatar's gaze.
import type { Look } from "../life/look.js";
import type { Orbit } from "../stage/orbit.js";

const NEARER = 0.5; // the pointer is taken to be at this part of the way from the avatar to the camera

/** Lets a gaze follow the pointer over the whole page. */
export class PointerGaze {
  private listening: AbortController | null = null;

  /** `look`: of the avatar that is shown. `moved` is called where a frame is needed. */
  constructor(
    private readonly host: HTMLElement,
    private readonly orbit: Orbit,
    private readonly look: () => Look | undefined,
    private readonly moved: () => void,
  ) {}

  set on(on: boolean) {
    if (on === (this.listening !== null)) return;
    this.listening?.abort();
    this.listening = on ? new AbortController() : null;
    if (!on) this.release();
    const signal = this.listening?.signal;
    if (signal === undefined) return;
    addEventListener("pointermove", (event) => this.follow(event), { signal, passive: true });
    document.documentElement.addEventListener("pointerleave", () => this.release(), { signal });
  }

  private release(): void {
    this.look()?.release();
    this.moved();
  }

  private follow({ clientX, clientY }: PointerEvent): void {
    const { left, top, width, height } = this.host.getBoundingClientRect();
    const { orbit } = this;
    const metres = orbit.metresAcross(height) / (NEARER * orbit.distance);
    const right = Math.atan((clientX - left - width / 2) * metres);
    const down = Math.atan((clientY - top - height / 2) * metres);
    this.look()?.at(orbit.yaw + right, orbit.pitch - down); // the picture's right is the person's left
    this.moved();
  }
}
