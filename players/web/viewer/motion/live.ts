// Live input and news from `avatar-export view`, over a WebSocket.
import { drivingFrame } from "../../src/index.js";
import type { ArkitInputs } from "../controls/channels.js";
import { setText } from "../parts/dom.js";

const RETRY_MS = [500, 1000, 2000, 5000] as const;
const QUIET_MS = 1500; // no packet for so long: input has stopped

/** What the server may say, besides live input. */
export interface LiveEvents {
  changed(id: string): void;
  message(text: string): void;
  /** A first packet after silence. */
  arrived(): void;
  /** The next frame shows a packet's pose, so the server wants to know when it is there. */
  posed(): void;
}

/** Follows live input: the newest packet wins, whatever their number. */
export class Live {
  /** Whether packets move the avatar. */
  follow = false;
  /** Called where a frame is needed. */
  ask: () => void = () => undefined;
  /** The newest frame, angles in radians. */
  readonly frame = drivingFrame();
  /** Packets so far. */
  packets = 0;

  private socket: WebSocket | null = null;
  private tries = 0;
  private fresh = false;
  private posed: number | null = null; // `time` of the packet that set the pose
  private drawing: number | null = null; // the same, of a frame that is not on the canvas yet
  private time: number | null = null;
  private lastMs = 0;
  private lastPackets = 0;
  private inputs: ArkitInputs | null = null;

  constructor(
    private readonly state: HTMLElement,
    private readonly events: LiveEvents,
  ) {
    setInterval(() => this.showState(), 500);
  }

  /** Listens to `./events`, and again where the connection breaks. */
  connect(): void {
    const address = new URL("./events", location.href);
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(address);
    this.socket = socket;
    socket.addEventListener("open", () => {
      this.tries = 0;
    });
    socket.addEventListener("message", (event) => this.take(event.data));
    socket.addEventListener("close", () => {
      const wait = RETRY_MS[Math.min(this.tries++, RETRY_MS.length - 1)];
      setTimeout(() => this.connect(), wait);
    });
  }

  /** Moves another avatar; null: it has no driving. */
  setAvatar(inputs: ArkitInputs | null): void {
    this.inputs = inputs;
  }

  /** A mover of the stage. */
  readonly move = (): boolean => {
    if (!this.fresh || !this.follow || this.inputs === null) return false;
    this.fresh = false;
    this.inputs.take(this.frame);
    this.inputs.apply();
    this.posed = this.time;
    this.events.posed();
    return false;
  };

  /** A frame was asked for, and `shown` follows when it is on the canvas. */
  awaiting(): void {
    this.drawing = this.posed ?? this.drawing;
    this.posed = null;
  }

  /** Reports to the server that the packet's pose is on the canvas. */
  shown(): void {
    if (this.drawing === null || this.socket?.readyState !== WebSocket.OPEN) return;
    this.socket.send(JSON.stringify({ type: "shown", time: this.drawing }));
    this.drawing = null;
  }

  private take(data: unknown): void {
    let said: Record<string, unknown>;
    try {
      said = JSON.parse(String(data)) as Record<string, unknown>;
    } catch {
      return; // the server's own messages are JSON; anything else is not for us
    }
    if (said === null || typeof said !== "object") return;
    if (said["type"] === "changed") this.events.changed(String(said["id"]));
    else if (said["type"] === "message") this.events.message(String(said["text"]));
    else if (said["type"] === "live") this.takeFrame(said);
  }

  private takeFrame(said: Record<string, unknown>): void {
    const { weights, head, leftEye, rightEye } = this.frame;
    if (!fill(weights, said["weights"])) return;
    fill(head, said["head"]);
    fill(leftEye, said["left_eye"]);
    fill(rightEye, said["right_eye"]);
    this.time = typeof said["time"] === "number" ? said["time"] : null;
    this.fresh = true;
    this.packets++;
    const now = performance.now();
    if (now - this.lastMs > QUIET_MS) {
      this.events.arrived();
      this.lastMs = now;
      this.showState();
    }
    this.lastMs = now;
    if (this.follow) this.ask();
  }

  private showState(): void {
    const rate = (this.packets - this.lastPackets) * 2;
    this.lastPackets = this.packets;
    const arriving = performance.now() - this.lastMs < QUIET_MS && this.packets > 0;
    this.state.classList.toggle("arriving", arriving);
    if (!arriving) setText(this.state, "Live: no data arrives");
    else setText(this.state, this.follow ? `Live: ${rate} frames a second` : "Live: data arrives, not followed");
  }
}

/** Copies finite numbers; false, and nothing is written, where `value` is no list of that length. */
function fill(out: Float32Array | Float64Array, value: unknown): boolean {
  if (!Array.isArray(value) || value.length !== out.length || !value.every(Number.isFinite)) return false;
  out.set(value as number[]);
  return true;
}
