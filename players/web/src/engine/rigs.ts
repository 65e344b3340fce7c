// The rigs of a scene whose avatars cast shadows. Their code loads with the first such scene.

import type { AvatarSceneOptions } from "./host.js";
import type { Rigs } from "./rig_mesh.js";

/** null: no shadows were asked for. Throws AvatarError where WebAssembly is not to be had. */
export async function rigsFor({ shadows }: AvatarSceneOptions): Promise<Rigs | null> {
  return shadows ? (await import("./rig_mesh.js")).Rigs.create() : null;
}
