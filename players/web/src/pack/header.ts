import { AvatarError } from "../errors.js";
import { membersOf } from "./form.js";
import { parseJson, shown, type Value } from "./json.js";

const METADATA = "__metadata__";

/** Where a tensor lies: bytes begin .. end of the body. */
export interface Entry {
  readonly begin: number;
  readonly end: number;
}

/** The header of a pack: its document, and its tensors by name. */
export interface Header {
  readonly document: Value;
  readonly tensors: ReadonlyMap<string, Entry>;
}

/** Reads the JSON header of a safetensors body whose tensors are bytes. Throws AvatarError. */
export function readHeader(bytes: Uint8Array): Header {
  const header = parseJson(bytes, "header");
  const members = membersOf(header);
  if (members !== header) throw new AvatarError(`is ${shown(header)}; a JSON object is needed`, { field: "header" });
  const tensors = new Map<string, Entry>();
  for (const [name, said] of Object.entries(members)) {
    if (name !== METADATA) tensors.set(name, readEntry(name, membersOf(said)));
  }
  const text = membersOf(members[METADATA])["pack"];
  if (typeof text !== "string") throw new AvatarError("is not a pack: it has no document 'pack' in its metadata");
  return { document: parseJson(text, "document 'pack'"), tensors };
}

function readEntry(name: string, { dtype, shape, data_offsets: offsets }: { readonly [name: string]: Value }): Entry {
  if (dtype === "U8" && Array.isArray(shape) && shape.length === 1 && Array.isArray(offsets) && offsets.length === 2) {
    const [begin, end] = offsets;
    if (isWhole(begin) && isWhole(end) && begin <= end && shape[0] === end - begin) return { begin, end };
  }
  throw new AvatarError("is not the entry of a tensor of bytes", { field: `header.${name.slice(0, 80)}` });
}

function isWhole(value: unknown): value is number {
  return Number.isInteger(value) && (value as number) >= 0;
}
