// The light that a text asks for. It loads where one does.

import presets from "light-presets:";
import { AvatarError } from "../errors.js";
import { fetchBytes } from "../fetch.js";
import type { Light } from "./light.js";

/** Lights by name. */
export const PRESETS = presets;

/** A name of `PRESETS`, JSON, or the address of a file of it. Throws AvatarError, which does not say whether it is a light. */
export async function lightAsked(said: string): Promise<Light> {
  if (Object.hasOwn(PRESETS, said)) return PRESETS[said] as Light;
  if (said.trimStart().startsWith("{")) return parsed(said);
  try {
    return parsed(new TextDecoder().decode(await fetchBytes(said)));
  } catch (error) {
    throw error instanceof AvatarError ? error.of(said) : error;
  }
}

function parsed(text: string): Light {
  try {
    return JSON.parse(text) as Light;
  } catch {
    const known = Object.keys(PRESETS).join(", ");
    throw new AvatarError(`is none of ${known}, no JSON, and no address of a JSON file`, { field: "light" });
  }
}
