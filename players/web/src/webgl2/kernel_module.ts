import { AvatarError } from "../errors.js";
import { KERNELS } from "../made/kernels.js";

/** The module of the kernels. Throws AvatarError where WebAssembly is not to be had. */
export async function kernelModule(): Promise<WebAssembly.Module> {
  if (typeof WebAssembly === "undefined") throw new AvatarError("this browser has no WebAssembly", { field: "WebGL2" });
  try {
    // WebKit's policy refuses an instance, and no module.
    return (await WebAssembly.instantiate(Uint8Array.from(KERNELS, (character) => character.charCodeAt(0)))).module;
  } catch {
    // The module is sound, so what is thrown is a refusal.
    throw new AvatarError(
      "this page's Content-Security-Policy forbids WebAssembly, needed for WebGL2 and shadows; add 'wasm-unsafe-eval' to its script-src",
      { field: "WebGL2" },
    );
  }
}
