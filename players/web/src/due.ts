// Which lists of passes are to be run: those whose inputs have changed.

import type { FrameLayout } from "./frame.js";
import { bindMesh, type Level } from "./pack/model.js";

/** What is due of one avatar. Set what has changed, then `decide`. */
export class Due {
  posed = true; // the pose has changed
  deformed = true; // constants of `deform` have
  shaded = true; // constants of `shadow` have
  viewed = true; // constants of `view` or `light` have
  // What `decide` found.
  mesh = false;
  deform = false;
  shadow = false;
  view = false;
  light = false;
  private old = true; // the mesh is of an earlier pose
  private wasLit = false;
  private readonly lit: number; // floats of the frame
  private readonly casts: number;
  private readonly deformReads: boolean; // the mesh
  private readonly shadowReads: boolean;

  constructor({ deform, shadow }: Pick<Level, "deform" | "shadow">, layout: FrameLayout) {
    this.lit = layout.lit;
    this.casts = (layout.first["shadow_offset"] as number) + 2;
    this.deformReads = bindMesh(deform);
    this.shadowReads = bindMesh(shadow);
  }

  /** Decides by the values of a frame, and takes all as run. */
  decide(floats: Float32Array): void {
    const lit = floats[this.lit] === 1;
    this.deform = this.posed || this.deformed;
    this.shaded ||= this.deform;
    this.shadow = lit && floats[this.casts] === 1 && this.shaded;
    // Stage light writes over what `view` gave.
    this.view = this.deform || this.viewed || this.shadow || lit !== this.wasLit;
    this.light = lit && this.view;
    this.old ||= this.posed;
    this.mesh = this.old && ((this.deform && this.deformReads) || (this.shadow && this.shadowReads));
    if (this.mesh) this.old = false;
    if (this.shadow) this.shaded = false;
    this.wasLit = lit;
    this.posed = this.deformed = this.viewed = false;
  }
}
