import { INTERFACES } from "../made/reflection.js";
import WORKER_TEXT from "inline-worker:./worker.ts";

/** A worker with the code of this package; it needs no address of its own. */
export function startWorker(): Worker {
  // The worker's text has no interfaces of its own: bundle.mjs.
  const interfaces = `globalThis.INTERFACES=${JSON.stringify(INTERFACES)};`;
  const address = URL.createObjectURL(new Blob([interfaces, WORKER_TEXT], { type: "text/javascript" }));
  const worker = new Worker(address);
  URL.revokeObjectURL(address);
  return worker;
}
