// What the adapters of all engines have in common.

import type { Avatar } from "../avatar.js";
import { AvatarError } from "../errors.js";
import type { Instance } from "../instance.js";

/** Options of `AvatarScene.create`. */
export interface AvatarSceneOptions {
  /**
   * On WebGL2, pictures wait for the avatars: what is drawn fits the camera and the pose exactly, and one scene can be
   * drawn from several cameras. The default false lets a worker compute: a picture shows its newest finished result,
   * usually one frame old. On WebGPU pictures always fit.
   */
  readonly synchronous?: boolean;
}

/** Avatars on the GPU of an engine. */
export interface AvatarHost {
  /** Resolves with a reason when no more avatars can be drawn. */
  readonly lost: Promise<string>;
  /** Throws AvatarError where the avatar exceeds a limit of the GPU, or has no such level. */
  add(avatar: Avatar, level: number): Instance;
  /** Resolves when all that the last picture asked for is computed. */
  finished(): Promise<void>;
  dispose(): void;
}

/** Draws avatars; `Seen` names the camera: [its type], or [] where the engine has an active one. */
export interface DrawingHost<Seen extends readonly unknown[]> extends AvatarHost {
  /** Draws what the camera sees into what the engine draws into now. */
  draw(...seen: Seen): void;
}

/** What draws. Throws AvatarError after `dispose`. */
export function madeOf<Host extends object>(host: Host | null): Host {
  if (host === null) throw new AvatarError("was disposed; create another", { owner: "AvatarScene" });
  return host;
}
