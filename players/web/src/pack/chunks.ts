import { AvatarError } from "../errors.js";
import { isU32 } from "./access.js";
import { U32_MAX } from "./json.js";
import type { Level } from "./model.js";

const MOST_ROWS = 65535 * 64; // thread groups of one dispatch, threads of one group

/** Names of the buffers of one kind, one a chunk of a level. */
export function levelNames(level: Level, kind: "Splats" | "Sh" | "Projected"): string[] {
  return level.chunks.map((_, index) => `${level.prefix}${kind}.${index}`);
}

/** The chunk whose buffer has that name; -1 if there is none. */
export function chunkOf(level: Level, kind: "Splats" | "Sh" | "Projected", name: string): number {
  const chunk = Number(name.slice(level.prefix.length + kind.length + 1));
  return level.chunks[chunk] !== undefined && name === `${level.prefix}${kind}.${chunk}` ? chunk : -1;
}

/** Throws AvatarError unless the chunks of a level follow each other and each fits one dispatch. */
export function checkChunks(place: string, level: Level): void {
  let first = 0;
  level.chunks.forEach((run, index) => {
    const field = `${place}, chunk ${index}`;
    if (!isU32(run.first) || run.first !== first) {
      throw new AvatarError(`begins at row ${run.first}, not ${first}`, { field });
    }
    if (!isU32(run.count) || run.count < 1 || run.count > MOST_ROWS) {
      throw new AvatarError(`has ${run.count} rows; 1 to ${MOST_ROWS} are taken`, { field });
    }
    first += run.count;
  });
  if (first < 1 || first > U32_MAX) throw new AvatarError(`has ${first} rows`, { field: place });
}
