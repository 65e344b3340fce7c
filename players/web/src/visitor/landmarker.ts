// MediaPipe's face landmarker inside a worker, from files of the same site. It never asks another site.
//
// Why release 0.10.35 of @mediapipe/tasks-vision and no later one: from 1.0 on it reports its use to its makers every
// minute. The release here holds no such code.

import { AvatarError } from "../errors.js";
import { fetchBytes } from "../fetch.js";
import type { Addresses } from "./messages.js";

/** What MediaPipe sees in a picture; each list has at most one face. */
export interface Sight {
  /** 478 points; x and y in shares of the picture, z in shares of its width. */
  readonly faceLandmarks: readonly (readonly Point[])[];
  /** 52 scores, `_neutral` first. */
  readonly faceBlendshapes: readonly { readonly categories: readonly { readonly categoryName: string; readonly score: number }[] }[];
  /** Camera from head, column-major, centimetres; OpenGL's axes. */
  readonly facialTransformationMatrixes: readonly { readonly data: readonly number[] }[];
}

/** A landmark. */
export interface Point {
  readonly x: number;
  readonly y: number;
  readonly z: number;
}

/** The landmarker. */
export interface Landmarker {
  detect(picture: ImageBitmap): Sight;
  close(): void;
}

interface Library {
  readonly FaceLandmarker: { createFromOptions(files: object, options: object): Promise<Landmarker> };
}

const scope = globalThis as unknown as {
  importScripts?(...addresses: string[]): void; // in a worker
  exports: Library; // of the bundle, a CommonJS module
  Module: object; // what MediaPipe's loader begins with
};

/** MediaPipe brings pictures in through WebGL 2. Workers of WebKitGTK, and of Safari before 17, have none. */
export function hasGraphics(): boolean {
  if (scope.importScripts === undefined) return document.createElement("canvas").getContext("webgl2") !== null;
  return typeof OffscreenCanvas !== "undefined" && new OffscreenCanvas(1, 1).getContext("webgl2") !== null;
}

/** Loads and starts it. Throws AvatarError for a missing file, and where the page may not run WebAssembly. */
export async function startLandmarker(addresses: Addresses, loaded: (bytes: number) => void): Promise<Landmarker> {
  checkPolicy();
  const counts = [0, 0];
  const counted = (at: number) => (bytes: number): void => {
    counts[at] = bytes;
    loaded((counts[0] as number) + (counts[1] as number));
  };
  const [wasm, model] = await Promise.all([
    bytesOf(addresses, "vision_wasm_internal.wasm.gz", counted(0)).then(plain),
    bytesOf(addresses, "face_landmarker.task", counted(1)),
  ]);
  scope.exports = {} as Library;
  await run(addresses, "vision_bundle.js");
  await run(addresses, "vision_wasm_internal.js");
  scope.Module = { wasmBinary: wasm };
  return scope.exports.FaceLandmarker.createFromOptions(
    { wasmLoaderPath: "", wasmBinaryPath: "" },
    {
      baseOptions: { modelAssetBuffer: model, delegate: "CPU" },
      runningMode: "IMAGE", // VIDEO smooths by itself, and lags
      numFaces: 1,
      outputFaceBlendshapes: true,
      outputFacialTransformationMatrixes: true,
      ...(scope.importScripts === undefined ? { canvas: document.createElement("canvas") } : {}),
    },
  );
}

/** An empty module is refused where the page's policy forbids WebAssembly; WebKit refuses its instance. */
function checkPolicy(): void {
  try {
    new WebAssembly.Instance(new WebAssembly.Module(new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0])));
  } catch {
    throw new AvatarError("the page's security policy forbids WebAssembly; add 'wasm-unsafe-eval' to its script-src");
  }
}

async function bytesOf(addresses: Addresses, name: keyof Addresses, loaded: (bytes: number) => void): Promise<Uint8Array> {
  try {
    return await fetchBytes(addresses[name], undefined, loaded);
  } catch (error) {
    throw error instanceof AvatarError ? error.of(name) : error;
  }
}

/** A server may have inflated it already. */
async function plain(bytes: Uint8Array): Promise<Uint8Array> {
  if (bytes[0] !== 0x1f || bytes[1] !== 0x8b) return bytes;
  const stream = new Blob([bytes as Uint8Array<ArrayBuffer>]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function run(addresses: Addresses, name: keyof Addresses): Promise<void> {
  try {
    if (scope.importScripts !== undefined) scope.importScripts(addresses[name]);
    else await runInPage(addresses[name]);
  } catch (error) {
    const why = error instanceof Error ? ` (${error.message})` : "";
    throw new AvatarError(`cannot be run${why}; put the files of the face tracker there again`, { owner: name });
  }
}

/** Runs a script of the page. Rejects where it is missing or forbidden. */
export function runInPage(address: string): Promise<void> {
  return new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = address;
    script.onload = () => resolve();
    script.onerror = () => reject();
    document.head.append(script);
  });
}
