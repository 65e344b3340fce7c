// What the page and the tracker (worker.ts) say to each other.

/** The tracker's files. All but tracker.js are other people's: MediaPipe's code and its model. */
export const TRACKER_FILES = [
  "tracker.js",
  "vision_bundle.js",
  "vision_wasm_internal.js",
  "vision_wasm_internal.wasm.gz",
  "face_landmarker.task",
] as const;

/** A file's name and its address. */
export type Addresses = Readonly<Record<(typeof TRACKER_FILES)[number], string>>;

/** What is seen: a face whose neutral look is learnt, one that is followed, or none. */
export type Seen = "learning" | "live" | "away";

/** To the tracker. `channels` is lent, and comes back with the answer. */
export type ToTracker =
  | { readonly kind: "start"; readonly addresses: Addresses; readonly mirror: boolean }
  | { readonly kind: "picture"; readonly picture: ImageBitmap; readonly ms: number; readonly channels: Float32Array<ArrayBuffer> }
  | { readonly kind: "learn" }
  | { readonly kind: "stop" };

/** From the tracker. */
export type FromTracker =
  | { readonly kind: "loaded"; readonly bytes: number }
  | { readonly kind: "ready" }
  | { readonly kind: "elsewhere" } // it cannot work in a worker
  | { readonly kind: "failed"; readonly owner: string | undefined; readonly reason: string }
  | { readonly kind: "channels"; readonly seen: Seen; readonly ms: number; readonly channels: Float32Array<ArrayBuffer> };
