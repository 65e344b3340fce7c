import type { Avatar } from "./avatar.js";
import { AvatarError } from "./errors.js";
import { FILE_LIMIT, fetchBytes, type Progress } from "./fetch.js";
import { INTERFACES } from "./made/reflection.js";
import type { Interfaces } from "./pack/access.js";
import { readPack } from "./pack/avatar.js";

/** How a pack is loaded. */
export interface LoadOptions {
  /** Stops a download; the promise is then rejected with the signal's reason. */
  readonly signal?: AbortSignal;
  /** Called during a download. `totalBytes` is null where the server does not say it. */
  readonly onProgress?: Progress;
  /** The name of the pack in messages; by default that of the file. */
  readonly name?: string;
  /** The entries that its passes may use; by default those of this package. */
  readonly reflection?: Interfaces;
}

/** Where a pack comes from. */
export type Source = string | URL | Blob | ArrayBuffer | Uint8Array;

/**
 * Loads and checks a pack: NAME.avatar, as `avatar-export pack` writes it. Nothing is uploaded to a GPU.
 *
 * Throws AvatarError for a download that fails and for a file that is no pack, is damaged, cut off or of a newer
 * version, or whose program would leave its buffers.
 */
export async function load(source: Source, options: LoadOptions = {}): Promise<Avatar> {
  const owner = options.name ?? nameOf(source);
  try {
    return await readPack(await bytesOf(source, options), options.reflection ?? INTERFACES);
  } catch (error) {
    throw error instanceof AvatarError ? error.of(owner) : error;
  }
}

async function bytesOf(source: Source, options: LoadOptions): Promise<Uint8Array> {
  if (source instanceof Uint8Array) return source;
  if (source instanceof ArrayBuffer) return new Uint8Array(source);
  if (source instanceof Blob) return readBlob(source);
  return fetchBytes(source, options.signal, options.onProgress);
}

async function readBlob(blob: Blob): Promise<Uint8Array> {
  if (blob.size > FILE_LIMIT) throw new AvatarError(`has ${blob.size} bytes; ${FILE_LIMIT} are the most`);
  try {
    return new Uint8Array(await blob.arrayBuffer());
  } catch (error) {
    throw new AvatarError(`cannot be read (${error instanceof Error ? error.message : ""}); choose the file again`);
  }
}

function nameOf(source: Source): string {
  if (typeof source === "string" || source instanceof URL) {
    const path = String(source).split(/[?#]/)[0] as string;
    return path.slice(path.lastIndexOf("/") + 1) || path || "the pack";
  }
  return typeof File !== "undefined" && source instanceof File ? source.name : "the pack";
}
