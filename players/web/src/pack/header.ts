import { AvatarError } from "../errors.js";
import { Json } from "./json.js";

const METADATA = "pack";
const MOST_OFFSET = 2 ** 48;

/** Where a tensor lies: bytes begin .. end of the body. */
export interface Entry {
  readonly begin: number;
  readonly end: number;
}

/** The header of a pack: its document, and its tensors by name. */
export interface Header {
  readonly document: Json;
  readonly tensors: ReadonlyMap<string, Entry>;
}

/** Reads the JSON header of a safetensors body whose tensors are bytes. Throws AvatarError. */
export function readHeader(bytes: Uint8Array): Header {
  const header = new Json(parse(bytes, "header"), "header");
  const tensors = new Map<string, Entry>();
  let text: string | null = null;
  for (const [name, said] of header.entries()) {
    if (name === "__metadata__") {
      text = said.optional(METADATA, (pack) => pack.text());
    } else {
      tensors.set(name, readEntry(said));
    }
  }
  if (text === null) throw new AvatarError(`is not a pack: it has no document '${METADATA}' in its metadata`);
  return { document: new Json(parse(text, `document '${METADATA}'`), "$"), tensors };
}

function readEntry(said: Json): Entry {
  const offsets = said.at("data_offsets").list(2, 2);
  const begin = (offsets[0] as Json).whole(0, MOST_OFFSET);
  const end = (offsets[1] as Json).whole(0, MOST_OFFSET);
  const [length] = said.at("shape").list(1, 1);
  if (said.at("dtype").text() !== "U8" || begin > end || (length as Json).whole(0, MOST_OFFSET) !== end - begin) {
    throw new AvatarError("is not the entry of a tensor of bytes", { field: said.path });
  }
  return { begin, end };
}

function parse(source: Uint8Array | string, what: string): unknown {
  try {
    const text = typeof source === "string" ? source : new TextDecoder("utf-8", { fatal: true }).decode(source);
    return JSON.parse(text);
  } catch (error) {
    throw new AvatarError(`its ${what} is not JSON (${error instanceof Error ? error.message.slice(0, 120) : ""})`);
  }
}
