import { AvatarError } from "../errors.js";
import { membersOf, versionOf } from "./form.js";
import { shown, type Value } from "./json.js";

/** The newest kernels that this player has. */
export const SHADERS = 1;
const UPDATE = "update avatar-export-player";
const MAJOR = 1;
const MINOR = 0;

/** Throws AvatarError for a document of a newer version than this player reads. Its form comes after that. */
export function checkVersions(document: Value): void {
  const members = membersOf(document);
  if (members !== document) throw new AvatarError(`is ${shown(document)}; a JSON object is needed`, { field: "$" });
  const asset = membersOf(members["asset"]);
  const [version, least] = ["version", "minVersion"].map((name) => {
    const found = versionOf(asset[name]);
    if (found !== null) return found;
    const said = asset[name] === undefined ? "missing" : shown(asset[name]);
    throw new AvatarError(`is ${said}; "MAJOR.MINOR" is needed`, { field: `$.asset.${name}` });
  }) as [[number, number], [number, number]];
  if (version[0] !== MAJOR || least[0] > MAJOR || (least[0] === MAJOR && least[1] > MINOR)) {
    const needs = `is ${version.join(".")} (needs a reader of ${least.join(".")})`;
    throw new AvatarError(`${needs}; this player knows ${MAJOR}.${MINOR}: ${UPDATE}`, { field: "$.asset.version" });
  }
  const required = members["extensionsRequired"];
  if (Array.isArray(required) && required.length > 0) {
    const message = `${shown(required[0])} is not known to this player: ${UPDATE}`;
    throw new AvatarError(message, { field: "$.extensionsRequired" });
  }
}

/** Throws AvatarError for passes of newer kernels than this player has. */
export function checkShaders(shaders: number): void {
  if (shaders <= SHADERS) return;
  throw new AvatarError(`needs kernels of version ${shaders}; this player has ${SHADERS}: ${UPDATE}`, { field: "$.shaders" });
}
