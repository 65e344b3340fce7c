// The page's side of the tracker: a worker, or where workers have no WebGL, the same script in the page.

import { AvatarError } from "../errors.js";
import { runInPage } from "./landmarker.js";
import { type Addresses, type FromTracker, type ToTracker, TRACKER_FILES } from "./messages.js";

/** Where the tracker's files lie: a folder's address, or the address of each file. */
export type Files = string | URL | Addresses;

/** What is heard of a tracker that runs. */
export interface TrackerEvents {
  channels(message: FromTracker & { kind: "channels" }): void;
  loaded(bytes: number): void;
  failed(error: AvatarError): void;
}

/** A tracker that runs. */
export class Tracker {
  private constructor(private readonly port: Worker | MessagePort) {}

  /** Loads and starts it. Throws AvatarError where files are missing or forbidden. */
  static async start(files: Files, mirror: boolean, events: TrackerEvents): Promise<Tracker> {
    const addresses = addressesOf(files);
    const inWorker = await Tracker.on(startWorker(addresses["tracker.js"]), events, addresses, mirror);
    if (inWorker !== null) return inWorker;
    const { port1, port2 } = new MessageChannel();
    await runInPage(addresses["tracker.js"]).catch(() => Promise.reject(notRun()));
    (globalThis as unknown as { startFaceTracker(port: MessagePort): void }).startFaceTracker(port1);
    const inPage = await Tracker.on(port2, events, addresses, mirror);
    if (inPage === null) throw new AvatarError("This browser has no WebGL 2, which the face tracker needs.");
    return inPage;
  }

  /** Sends a message; what is in `transfer` goes with it. */
  send(message: ToTracker, transfer: Transferable[] = []): void {
    this.port.postMessage(message, transfer);
  }

  /** Ends it. */
  stop(): void {
    this.send({ kind: "stop" });
    if ("terminate" in this.port) this.port.terminate();
    else this.port.close();
  }

  /** The tracker at the other end of a port; null: it cannot work there. */
  private static on(port: Worker | MessagePort, events: TrackerEvents, addresses: Addresses, mirror: boolean): Promise<Tracker | null> {
    return new Promise((resolve, reject) => {
      const tracker = new Tracker(port);
      const failed = (error: AvatarError): void => {
        tracker.stop();
        reject(error); // while it starts
        events.failed(error);
      };
      port.onmessage = ({ data }: MessageEvent<FromTracker>) => {
        if (data.kind === "channels") events.channels(data);
        else if (data.kind === "loaded") events.loaded(data.bytes);
        else if (data.kind === "ready") resolve(tracker);
        else if (data.kind === "failed") failed(new AvatarError(data.reason, { owner: data.owner }));
        else {
          tracker.stop();
          resolve(null);
        }
      };
      if ("onerror" in port) {
        port.onerror = (event) => {
          (event as Event).preventDefault();
          failed(notRun());
        };
      }
      tracker.send({ kind: "start", addresses, mirror });
    });
  }
}

/** Throws AvatarError for another site, which a browser starts no worker from. */
function addressesOf(files: Files): Addresses {
  const folder = typeof files === "string" || files instanceof URL ? new URL(`${files}`.replace(/\/?$/, "/"), location.href) : null;
  const address = (name: keyof Addresses): string =>
    new URL(folder === null ? (files as Addresses)[name] : new URL(name, folder), location.href).href;
  const found = Object.fromEntries(TRACKER_FILES.map((name) => [name, address(name)])) as Addresses;
  if (new URL(found["tracker.js"]).origin === location.origin) return found;
  throw new AvatarError("must lie on the page's own site", { owner: found["tracker.js"] });
}

function startWorker(address: string): Worker {
  try {
    return new Worker(address);
  } catch {
    throw notRun(); // a policy of the page
  }
}

function notRun(): AvatarError {
  return new AvatarError("cannot be loaded, or the page's security policy forbids it; put the face tracker's files on this site", {
    owner: "tracker.js",
  });
}
