// Holds a light that somebody has written against what a light is, as avatar_runtime/light.py does.

import { AvatarError } from "../errors.js";
import type { DirectLight, Light } from "./light.js";

export const MOST_LIGHTS = 4;
export const AMBIENT_TERMS = 9;
const LARGEST = 1e4; // of a colour: brighter than any light of a scene
const FURTHEST = 1e9; // of any other number: further away than any
const KNOWN = ["ambient", "lights", "shadow", "frame", "name"]; // the last two are of lights in files

/** Throws AvatarError, which names the field, unless `said` is a light. */
export function checkLight(said: unknown): asserts said is Light {
  if (typeof said !== "object" || said === null || Array.isArray(said)) throw new AvatarError("is no JSON object with a light", { field: "light" });
  for (const name in said) {
    if (!KNOWN.includes(name)) throw new AvatarError("is not known; a light has ambient, lights and shadow", { field: name });
  }
  const { ambient, lights, shadow } = said as Record<keyof Light, unknown>;
  if (lights !== undefined && !(Array.isArray(lights) && lights.length <= MOST_LIGHTS)) {
    throw new AvatarError(`is no list of up to ${MOST_LIGHTS} lights`, { field: "lights" });
  }
  if (shadow !== undefined && typeof shadow !== "boolean") throw new AvatarError("is neither true nor false", { field: "shadow" });
  if (ambient !== undefined) checkAmbient(ambient);
  for (let k = 0; k < (lights?.length ?? 0); k++) checkDirect((lights as unknown[])[k], k);
}

/** Whether `ambient` is nine rows, not one colour. */
export function hasTerms(ambient: readonly unknown[]): ambient is readonly (readonly number[])[] {
  return ambient.length === AMBIENT_TERMS;
}

function checkAmbient(said: unknown): void {
  if (!Array.isArray(said) || (said.length !== 3 && !hasTerms(said))) {
    throw new AvatarError("is neither a colour nor nine rows of one", { field: "ambient" });
  }
  if (said.length === 3) checkThree(said, "ambient", -1, "");
  else for (let k = 0; k < AMBIENT_TERMS; k++) checkThree(said[k], "ambient", k, "");
}

function checkDirect(said: unknown, k: number): void {
  const one = (typeof said === "object" && said !== null ? said : {}) as Partial<Record<"direction" | "position" | "colour", unknown>>;
  let members = 0;
  for (const _ in one) members++;
  const place = one.position ?? one.direction;
  if (members !== 2 || place === undefined || one.colour === undefined) {
    throw new AvatarError("needs a direction or a position, and a colour", { field: `lights[${k}]` });
  }
  const name = one.position === undefined ? ".direction" : ".position";
  checkThree(place, "lights", k, name);
  checkThree(one.colour, "lights", k, ".colour");
  const { colour } = one as DirectLight;
  if (Math.min(colour[0], colour[1], colour[2]) < 0 || Math.max(colour[0], colour[1], colour[2]) > LARGEST) {
    throw new AvatarError(`is not within 0 and ${LARGEST}`, { field: `lights[${k}].colour` });
  }
  const at = place as readonly number[];
  const squared = (at[0] as number) ** 2 + (at[1] as number) ** 2 + (at[2] as number) ** 2;
  if (name === ".direction" && !(squared > 0)) throw new AvatarError("has no length", { field: `lights[${k}].direction` });
}

/** `row` -1: none. */
function checkThree(said: unknown, list: string, row: number, name: string): void {
  let sound = Array.isArray(said) && said.length === 3;
  for (let c = 0; sound && c < 3; c++) sound = typeof (said as unknown[])[c] === "number" && Math.abs((said as number[])[c] as number) <= FURTHEST;
  if (!sound) throw new AvatarError("is not three numbers of at most 1e9", { field: `${list}${row < 0 ? "" : `[${row}]`}${name}` });
}
