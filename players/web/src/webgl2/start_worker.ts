// Starts the worker of the kernels.

import { AvatarError } from "../errors.js";
import { INTERFACES } from "../made/reflection.js";
import { kernelModule } from "./kernel_module.js";
import type { FromWorker, StartMessage } from "./messages.js";

/**
 * A worker that has its kernels. Its script is worker.js beside this one, which strict pages allow; where there is none
 * (all is one file, this script is another site's, a bundler left it out), a text.
 *
 * Throws AvatarError where the page's policy forbids WebAssembly or workers.
 */
export async function startWorker(): Promise<Worker> {
  const start: StartMessage = { kind: "start", kernels: await kernelModule(), interfaces: INTERFACES };
  try {
    return await started(() => new Worker(new URL("./worker.js", import.meta.url)), start);
  } catch {
    return startText(start);
  }
}

async function startText(start: StartMessage): Promise<Worker> {
  const { default: text } = await import("inline-worker:./worker.ts");
  const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  try {
    return await started(() => new Worker(address), start);
  } catch (error) {
    const why = (error as Error).message || "it is blocked";
    throw new AvatarError(
      `the worker cannot start (${why}); serve worker.js of this package beside its other files, and allow 'self' in worker-src of the page's Content-Security-Policy`,
      { field: "WebGL2" },
    );
  } finally {
    URL.revokeObjectURL(address);
  }
}

/** Makes a worker; resolves when it has started, and is rejected when it cannot. */
function started(make: () => Worker, start: StartMessage): Promise<Worker> {
  return new Promise((resolve, reject) => {
    const worker = make();
    const fail = (reason: string): void => {
      worker.terminate();
      reject(new Error(reason));
    };
    worker.onmessage = ({ data }: MessageEvent<FromWorker>) => (data.kind === "failed" ? fail(data.message) : resolve(worker));
    worker.onerror = (event) => {
      event.preventDefault(); // it is told by whoever waits
      fail(event.message);
    };
    worker.postMessage(start);
  });
}
