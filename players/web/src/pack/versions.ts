import { AvatarError } from "../errors.js";
import type { Json } from "./json.js";

/** The newest kernels that this player has. */
export const SHADERS = 1;
const UPDATE = "update avatar-export-player";
const MAJOR = 1;
const MINOR = 0;
const VERSION = /^(0|[1-9][0-9]{0,8})\.(0|[1-9][0-9]{0,8})$/;

/** Throws AvatarError for a document that is no pack's, or of a newer version than this player reads. */
export function checkVersions(document: Json): void {
  const asset = document.at("asset");
  const version = parsed(asset.at("version"));
  const least = parsed(asset.at("minVersion"));
  if (version[0] !== MAJOR || least[0] > MAJOR || (least[0] === MAJOR && least[1] > MINOR)) {
    const needs = `is ${version.join(".")} (needs a reader of ${least.join(".")})`;
    throw new AvatarError(`${needs}; this player knows ${MAJOR}.${MINOR}: ${UPDATE}`, { field: "$.asset.version" });
  }
  const required = document.optional("extensionsRequired", (names) => names.names()) ?? [];
  if (required.length > 0) {
    const name = (required[0] as string).slice(0, 80);
    throw new AvatarError(`'${name}' is not known to this player: ${UPDATE}`, { field: "$.extensionsRequired" });
  }
  document.at("format").one(["avatar-pack"]);
  const shaders = document.at("shaders").whole(1);
  if (shaders > SHADERS) {
    throw new AvatarError(`needs kernels of version ${shaders}; this player has ${SHADERS}: ${UPDATE}`, {
      field: "$.shaders",
    });
  }
}

function parsed(said: Json): [major: number, minor: number] {
  const match = VERSION.exec(said.text());
  if (match === null) throw said.error('"MAJOR.MINOR" is needed');
  return [Number(match[1]), Number(match[2])];
}
