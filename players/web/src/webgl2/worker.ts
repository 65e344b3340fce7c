// The worker: computes quads while the page goes on. It is bundled into one script.

import { INTERFACES } from "../made/reflection.js";
import { KernelDesk } from "./kernel_desk.js";
import type { FromWorker, StartMessage, ToWorker } from "./messages.js";

let module: WebAssembly.Module;
const desks = new Map<number, KernelDesk>(); // by scene
const lent: ArrayBuffer[] = [];
const port = globalThis as unknown as {
  onmessage: (event: MessageEvent<ToWorker>) => void;
  postMessage(message: FromWorker, transfer: Transferable[]): void;
};

port.onmessage = ({ data }) => {
  const answer = data.kind === "start" ? begin(data) : obey(data);
  if (answer === null) return;
  lent.length = 0;
  if (answer.kind === "quads") lent.push(answer.inputs.buffer, answer.quads.buffer);
  port.postMessage(answer, lent);
};

function begin({ kernels, interfaces }: StartMessage): FromWorker {
  Object.assign(INTERFACES, interfaces); // this script has none of its own: bundle.mjs
  module = kernels;
  return { kind: "ready" };
}

function obey(message: Exclude<ToWorker, StartMessage>): FromWorker | null {
  const scene = message.scene as number;
  if (message.kind === "end") {
    desks.delete(scene);
    return null;
  }
  let desk = desks.get(scene);
  if (desk === undefined) desks.set(scene, (desk = new KernelDesk(module)));
  const answer: FromWorker | null = desk.answer(message);
  if (answer !== null) answer.scene = scene;
  return answer;
}
