// The page's one worker, and the ports of its scenes.

import { Shared, type Lease } from "../shared.js";
import type { Addressed, FromWorker, SceneAnswer, SceneMessage } from "./messages.js";
import type { QuadPort } from "./quad_source.js";
import { startWorker } from "./start_worker.js";

/** The worker and who listens to it, by the number of the scene. */
interface Served {
  readonly worker: Worker;
  readonly ports: Map<number, ScenePort>;
}

const WORKER: Shared<Promise<Served>> = new Shared(
  () => {
    const asked = startWorker().then((worker) => {
      const ports = new Map<number, ScenePort>();
      worker.onmessage = (event: MessageEvent<FromWorker & Addressed>) => ports.get(event.data.scene as number)?.onmessage?.(event as MessageEvent<SceneAnswer>);
      worker.onerror = (event) => {
        WORKER.forget(asked);
        for (const port of ports.values()) port.onerror?.(event);
      };
      return { worker, ports };
    });
    asked.catch(() => WORKER.forget(asked));
    return asked;
  },
  (asked) => void asked.then(({ worker }) => worker.terminate()).catch(() => undefined),
);

let scenes = 0; // numbers that were given

/** A scene of the page's worker, which starts with the first. Throws AvatarError as `startWorker` does. */
export async function openPort(): Promise<QuadPort> {
  const lease = WORKER.take();
  try {
    return new ScenePort(await lease.value, lease);
  } catch (error) {
    lease.release();
    throw error;
  }
}

class ScenePort implements QuadPort {
  onmessage: ((event: MessageEvent<SceneAnswer>) => void) | null = null;
  onerror: ((event: ErrorEvent) => void) | null = null;
  private readonly scene = ++scenes;

  constructor(
    private readonly served: Served,
    private readonly lease: Lease<unknown>,
  ) {
    served.ports.set(this.scene, this);
  }

  postMessage(message: SceneMessage & Addressed, transfer: Transferable[] = []): void {
    message.scene = this.scene;
    this.served.worker.postMessage(message, transfer);
  }

  terminate(): void {
    this.served.ports.delete(this.scene);
    this.served.worker.postMessage({ kind: "end", scene: this.scene });
    this.lease.release();
  }
}
