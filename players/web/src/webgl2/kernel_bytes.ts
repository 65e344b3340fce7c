import { KERNELS } from "../made/kernels.js";

/** The WebAssembly module of the kernels. */
export function kernelBytes(): ArrayBuffer {
  return Uint8Array.from(atob(KERNELS), (character) => character.charCodeAt(0)).buffer;
}
