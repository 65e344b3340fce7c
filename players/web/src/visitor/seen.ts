// What a camera tells about a face, and what not.

import { TRUST } from "../made/face_trust.js";
import { ARKIT_NAMES } from "../pose/arkit.js";

const BADLY = 0.4;

/** ARKit names that are not read from a camera: their weights stay 0. */
export const NOT_SEEN: readonly string[] = ARKIT_NAMES.filter((name) => TRUST[name] === 0);

/** ARKit names that are read, but badly. */
export const SEEN_BADLY: readonly string[] = ARKIT_NAMES.filter((name) => TRUST[name]! > 0 && TRUST[name]! < BADLY);
