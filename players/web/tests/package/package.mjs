// The package as npm installs it: the folder that AVATAR_PACKAGE names.
import { readdirSync } from "node:fs";
import { join } from "node:path";

/** The folder of the package. */
export const PACKAGE = process.env.AVATAR_PACKAGE;

/** {address below `base`: file} of its scripts and the sample. */
export function built(base) {
  const names = readdirSync(join(PACKAGE, "dist")).filter((name) => /\.(js|avatar)$/.test(name));
  return Object.fromEntries(names.map((name) => [`${base}/${name}`, join(PACKAGE, "dist", name)]));
}
