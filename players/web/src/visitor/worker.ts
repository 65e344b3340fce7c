// The tracker: pictures in, ARKit channels out. In a worker, so that the page draws on while a picture is looked at; where
// workers have no WebGL, as a script of the page.

import { AvatarError } from "../errors.js";
import { Follower } from "./follower.js";
import { hasGraphics, type Landmarker, startLandmarker } from "./landmarker.js";
import type { Addresses, FromTracker, ToTracker } from "./messages.js";

/** One end of the talk with the page: the worker itself, or a MessagePort. */
interface Port {
  onmessage: ((event: MessageEvent<ToTracker>) => void) | null;
  postMessage(message: FromTracker, transfer?: Transferable[]): void;
}

class Tracker {
  private landmarker: Landmarker | null = null;
  private follower = new Follower(true);

  constructor(private readonly port: Port) {
    port.onmessage = ({ data }) => {
      if (data.kind === "start") void this.start(data.addresses, data.mirror);
      else if (data.kind === "learn") this.follower.learn();
      else if (data.kind === "stop") this.landmarker?.close();
      else this.look(data.picture, data.ms, data.channels);
    };
  }

  private async start(addresses: Addresses, mirror: boolean): Promise<void> {
    if (!hasGraphics()) return this.port.postMessage({ kind: "elsewhere" });
    try {
      this.follower = new Follower(mirror);
      this.landmarker = await startLandmarker(addresses, (bytes) => this.port.postMessage({ kind: "loaded", bytes }));
      this.port.postMessage({ kind: "ready" });
    } catch (error) {
      this.failed(error);
    }
  }

  private look(picture: ImageBitmap, ms: number, channels: Float32Array<ArrayBuffer>): void {
    if (this.landmarker === null) return;
    try {
      const sight = this.landmarker.detect(picture);
      const seen = this.follower.follow(sight, picture.width / picture.height, ms / 1000, channels);
      this.port.postMessage({ kind: "channels", seen, ms, channels }, [channels.buffer]);
    } catch (error) {
      this.failed(error);
    } finally {
      picture.close();
    }
  }

  private failed(error: unknown): void {
    const owner = error instanceof AvatarError ? error.owner : undefined;
    const reason = error instanceof AvatarError ? error.reason : `the face tracker fails: ${String(error)}`;
    this.port.postMessage({ kind: "failed", owner, reason });
  }
}

const scope = globalThis as unknown as { importScripts?: unknown; startFaceTracker?: (port: Port) => void };
if (scope.importScripts !== undefined) new Tracker(globalThis as unknown as Port);
else scope.startFaceTracker = (port) => void new Tracker(port);
