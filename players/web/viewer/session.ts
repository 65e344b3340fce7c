// What the page shows: `session.json` beside it, or the same inside the page (one HTML file that opens by double-click).
import { AvatarError } from "../src/index.js";
import { type Addresses, TRACKER_FILES } from "../src/visitor.js";

/** An avatar that the page can open. */
export interface Entry {
  readonly id: string;
  readonly name: string;
  readonly file: string; // address relative to the page, or a `data:` address with the whole file
  readonly preview: string | null; // address of a picture
  readonly bytes: number;
  readonly license: string | null;
  readonly consent: string | null;
}

/** The content of `session.json`. */
export interface Session {
  readonly avatars: readonly Entry[];
  readonly live: boolean; // live input may arrive
  readonly events: boolean; // ./events is a WebSocket
  readonly present: boolean; // the page opens with the avatar alone
  readonly gallery: string | null; // address of a page with all avatars
  readonly talk: Addresses | null; // the face tracker's files; null: the page offers no camera
}

export const EMPTY: Session = { avatars: [], live: false, events: false, present: false, gallery: null, talk: null };

/** Reads the session. Throws AvatarError where it is there but cannot be read; without any, nothing is to show yet. */
export async function readSession(): Promise<Session> {
  const inline = document.getElementById("session");
  if (inline !== null) return parse(inline.textContent ?? "");
  if (location.protocol === "file:") return EMPTY; // a browser does not let a file read its neighbours
  const answer = await fetch("./session.json", { cache: "no-store" });
  if (answer.status === 404) return EMPTY;
  if (!answer.ok) {
    throw new AvatarError(`the server answers ${answer.status}; start avatar-export view again`, { owner: "session.json" });
  }
  return parse(await answer.text());
}

function parse(text: string): Session {
  let found: unknown;
  try {
    found = JSON.parse(text);
  } catch {
    throw new AvatarError("is no JSON; make the page again", { owner: "session.json" });
  }
  const root = record(found);
  const avatars = Array.isArray(root["avatars"]) ? root["avatars"] : [];
  return {
    avatars: avatars.map((value: unknown, i) => entry(record(value), i)),
    live: root["live"] === true,
    events: root["events"] === true,
    present: root["present"] === true,
    gallery: typeof root["gallery"] === "string" ? root["gallery"] : null,
    talk: talk(record(root["talk"])),
  };
}

function talk(found: Readonly<Record<string, unknown>>): Addresses | null {
  return TRACKER_FILES.every((name) => typeof found[name] === "string") ? (found as Addresses) : null;
}

function record(value: unknown): Readonly<Record<string, unknown>> {
  return typeof value === "object" && value !== null ? (value as Record<string, unknown>) : {};
}

function entry(value: Readonly<Record<string, unknown>>, index: number): Entry {
  const text = (key: string): string | null => (typeof value[key] === "string" && value[key] !== "" ? (value[key] as string) : null);
  const file = text("file");
  if (file === null) {
    throw new AvatarError("is missing; make the page again", { owner: "session.json", field: `avatars[${index}].file` });
  }
  return {
    id: text("id") ?? String(index),
    name: text("name") ?? file,
    file,
    preview: text("preview"),
    bytes: typeof value["bytes"] === "number" ? value["bytes"] : 0,
    license: text("license"),
    consent: text("consent"),
  };
}

/** What `load` takes for an entry: an address, or the bytes of a `data:` address, which a page from a file cannot fetch. */
export function sourceOf(entry: Entry): string | Uint8Array<ArrayBuffer> {
  const found = /^data:[^,]*;base64,/.exec(entry.file);
  if (found === null) return new URL(entry.file, location.href).href;
  const characters = atob(entry.file.slice(found[0].length));
  const bytes = new Uint8Array(characters.length);
  for (let i = 0; i < bytes.length; i++) bytes[i] = characters.charCodeAt(i);
  return bytes;
}
