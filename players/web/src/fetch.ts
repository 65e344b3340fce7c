import { AvatarError } from "./errors.js";

/** The most bytes of a pack. */
export const FILE_LIMIT = 2 ** 30;
const FIRST = 1 << 16; // bytes of the first piece of memory where the length is not known

const HTML = /^\s*<[!a-z]/i; // no pack begins so

/** Called during a download; `totalBytes` is null where the server does not say it. */
export type Progress = (loadedBytes: number, totalBytes: number | null) => void;

/** The bytes at an address. Throws AvatarError for a download that fails, and the signal's reason if it is aborted. */
export async function fetchBytes(url: string | URL, signal?: AbortSignal, onProgress?: Progress): Promise<Uint8Array> {
  const response = await asked(url, signal);
  if (!response.ok) {
    throw new AvatarError(`cannot be loaded: the server answers ${response.status} ${response.statusText}`.trimEnd());
  }
  const total = lengthOf(response);
  if (total !== null && total > FILE_LIMIT) throw new AvatarError(`has ${total} bytes; ${FILE_LIMIT} are the most`);
  if (response.body === null) throw new AvatarError("cannot be loaded: the server sends nothing");
  const bytes = await collected(response.body.getReader(), total, signal, onProgress);
  if (total !== null && bytes.length !== total) {
    throw new AvatarError(`was cut off: ${bytes.length} of ${total} bytes arrived; load it again`);
  }
  if (HTML.test(new TextDecoder().decode(bytes.subarray(0, 64)))) {
    throw new AvatarError("cannot be loaded: its address answers an HTML page, not this file; is the address right?");
  }
  return bytes;
}

async function asked(url: string | URL, signal: AbortSignal | undefined): Promise<Response> {
  try {
    return await fetch(url, signal === undefined ? {} : { signal });
  } catch (error) {
    signal?.throwIfAborted();
    throw new AvatarError(
      `cannot be loaded: ${why(error)}; is the address right, and does its server allow this page to read it?`,
    );
  }
}

/** Content-Length; null if it is not stated, or is that of a compressed transfer. */
function lengthOf(response: Response): number | null {
  const stated = response.headers.get("content-length");
  const encoded = response.headers.get("content-encoding");
  const plain = encoded === null || encoded === "identity";
  return plain && stated !== null && /^[0-9]+$/.test(stated) ? Number(stated) : null;
}

async function collected(
  reader: ReadableStreamDefaultReader<Uint8Array>,
  total: number | null,
  signal: AbortSignal | undefined,
  onProgress: Progress | undefined,
): Promise<Uint8Array> {
  let bytes = new Uint8Array(total ?? FIRST);
  let loaded = 0;
  onProgress?.(0, total);
  for (;;) {
    const part = await piece(reader, loaded, total, signal);
    if (part === null) return bytes.subarray(0, loaded);
    if (loaded + part.length > (total ?? FILE_LIMIT)) {
      void reader.cancel().catch(() => undefined);
      const most = total === null ? `${FILE_LIMIT} bytes` : `the ${total} bytes that the server states`;
      throw new AvatarError(`has more than ${most}`);
    }
    if (loaded + part.length > bytes.length) {
      const larger = new Uint8Array(Math.min(FILE_LIMIT, Math.max(2 * bytes.length, loaded + part.length)));
      larger.set(bytes.subarray(0, loaded));
      bytes = larger;
    }
    bytes.set(part, loaded);
    loaded += part.length;
    onProgress?.(loaded, total);
  }
}

async function piece(
  reader: ReadableStreamDefaultReader<Uint8Array>,
  loaded: number,
  total: number | null,
  signal: AbortSignal | undefined,
): Promise<Uint8Array | null> {
  try {
    const { done, value } = await reader.read();
    return done ? null : value;
  } catch (error) {
    signal?.throwIfAborted();
    const of = total === null ? "" : ` of ${total}`;
    throw new AvatarError(`was cut off after ${loaded}${of} bytes (${why(error)}); load it again`);
  }
}

function why(error: unknown): string {
  return error instanceof Error ? error.message : String(error);
}
