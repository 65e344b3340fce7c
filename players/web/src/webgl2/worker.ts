// The worker: computes quads while the page goes on. It is bundled into one text.

import { KernelDesk } from "./kernel_desk.js";
import type { FromWorker, ToWorker } from "./messages.js";

const desk = new KernelDesk();
const lent: ArrayBuffer[] = [];
const port = globalThis as unknown as {
  onmessage: (event: MessageEvent<ToWorker>) => void;
  postMessage(message: FromWorker, transfer: Transferable[]): void;
};

port.onmessage = ({ data }) => {
  const answer = desk.answer(data);
  if (answer === null) return;
  lent.length = 0;
  if (answer.kind === "quads") lent.push(answer.inputs.buffer, answer.quads.buffer);
  port.postMessage(answer, lent);
};
