// The light of a scene as the values of a frame that stages `shadow` and `light` take, as avatar_runtime/light.py has it.

import type { Relight } from "../avatar.js";
import type { Posed } from "../pose/poser.js";
import { SH_C0, SHADOW_SIZE } from "../made/constants.js";
import { invertLinear } from "../pose/affine.js";
import type { Light } from "./light.js";
import { AMBIENT_TERMS, checkLight, hasTerms, MOST_LIGHTS } from "./said.js";
import { setShadowRows } from "./shadow_rows.js";
import { setTurn, turned } from "./turned.js";

// How far a Gaussian is moved along its normal, and along the light, before it is asked whether it lies in shadow: trained
// Gaussians lie in layers about the skin (metres), and a map has an edge of texels.
const LAYERS = [0.006, 0.004] as const, TEXELS = [1.5, 1] as const;
// First floats of the values, after the first of all.
const PLACE = 4 * AMBIENT_TERMS, COLOUR = PLACE + 4 * MOST_LIGHTS, TURN = COLOUR + 4 * MOST_LIGHTS, SHADOW = TURN + 12, OFFSET = SHADOW + 16;

const BLACK = [0, 0, 0] as const, NONE = [] as const; // made once: a light may be set for each frame
const INVERSE = new Float64Array(12); // of the linear part of `place`
const FIRST = new Float64Array(4); // the first light in the pack's space: direction and 0, or position and 1
const CENTRE = new Float64Array(3); // of what casts shadows
const ROWS = new Float64Array(16);

/** A light in numbers. They may be written by hand; `write` reads them. Nothing but `said` allocates. */
export class Lighting {
  readonly ambient = new Float64Array(3 * AMBIENT_TERMS); // [9, 3]
  readonly places = new Float64Array(4 * MOST_LIGHTS); // towards the light and 0, or its position and 1
  readonly colours = new Float64Array(3 * MOST_LIGHTS);
  count = 0; // lights
  shadow = false;

  /** Throws AvatarError, which names the field, and leaves the light as it was. */
  set(light: Light): void {
    checkLight(light);
    const { ambient = BLACK, lights = NONE, shadow = false } = light;
    this.ambient.fill(0);
    if (hasTerms(ambient)) {
      for (let i = 0; i < this.ambient.length; i++) this.ambient[i] = (ambient[(i / 3) | 0] as readonly number[])[i % 3] as number;
    } else {
      for (let c = 0; c < 3; c++) this.ambient[c] = (ambient[c] as number) / (SH_C0[0] as number);
    }
    this.count = lights.length;
    for (let k = 0; k < lights.length; k++) {
      const one = lights[k] as { position?: readonly number[]; direction?: readonly number[]; colour: readonly number[] };
      const place = (one.position ?? one.direction) as readonly number[];
      for (let c = 0; c < 3; c++) {
        this.places[4 * k + c] = place[c] as number;
        this.colours[3 * k + c] = one.colour[c] as number;
      }
      this.places[4 * k + 3] = one.position === undefined ? 0 : 1;
    }
    this.shadow = shadow;
  }

  /**
   * Writes all values from `out[at]` on, for a posed avatar that the scene puts at `place` [4, 4], scene from pack: any
   * affine matrix. `joint`: the first float of the skin matrix that the light of the capture follows; -1: none.
   */
  write(out: Float32Array, at: number, relight: Relight, place: Float64Array, posed: Posed, joint: number): void {
    const world = posed.worldFromAvatar;
    invertLinear(INVERSE, 0, place, 0);
    const scale = setTurn(place);
    turned(out, at, this.ambient);
    out.fill(0, at + PLACE, at + OFFSET + 4);
    for (let k = 0; k < this.count; k++) this.writeDirect(out, at, k, place, scale);
    writeTurn(out, at + TURN, relight.frame === "head" ? world : null, posed.poseFloats, joint);
    if (this.shadow && this.count > 0) this.writeShadow(out, at, relight, place, world);
  }

  private writeDirect(out: Float32Array, at: number, k: number, place: Float64Array, scale: number): void {
    this.setPlace(k, place);
    const point = FIRST[3] === 1;
    const length = point ? 1 : Math.sqrt((FIRST[0] as number) ** 2 + (FIRST[1] as number) ** 2 + (FIRST[2] as number) ** 2) || 1; // an engine's may have none: then it lights nothing
    for (let c = 0; c < 3; c++) {
      out[at + PLACE + 4 * k + c] = (FIRST[c] as number) / length;
      // Distances in the pack's space are those of the scene over `scale`.
      out[at + COLOUR + 4 * k + c] = (this.colours[3 * k + c] as number) / (point ? scale * scale : 1);
    }
    out[at + PLACE + 4 * k + 3] = FIRST[3] as number;
  }

  /** Writes light k in the pack's space into FIRST. */
  private setPlace(k: number, place: Float64Array): void {
    const { places } = this;
    const point = places[4 * k + 3] as number;
    const x = (places[4 * k] as number) - point * (place[3] as number);
    const y = (places[4 * k + 1] as number) - point * (place[7] as number);
    const z = (places[4 * k + 2] as number) - point * (place[11] as number);
    for (let i = 0; i < 3; i++) {
      FIRST[i] = (INVERSE[4 * i] as number) * x + (INVERSE[4 * i + 1] as number) * y + (INVERSE[4 * i + 2] as number) * z;
    }
    FIRST[3] = point;
  }

  private writeShadow(out: Float32Array, at: number, { centre, radius }: Relight, place: Float64Array, world: Float64Array): void {
    this.setPlace(0, place);
    for (let i = 0; i < 3; i++) {
      CENTRE[i] = world[4 * i + 3] as number;
      for (let c = 0; c < 3; c++) CENTRE[i] = (CENTRE[i] as number) + (world[4 * i + c] as number) * (centre[c] as number);
    }
    if (!setShadowRows(ROWS, FIRST, CENTRE, radius)) return;
    out.set(ROWS, at + SHADOW);
    const texel = (2 * radius) / SHADOW_SIZE;
    for (let i = 0; i < 2; i++) out[at + OFFSET + i] = (LAYERS[i] as number) + (TEXELS[i] as number) * texel;
    out[at + OFFSET + 2] = 1;
  }
}

/** The frame that the light of the capture moves with from world: the turn of `world` [4, 4] (null: none), then that of a joint. */
function writeTurn(out: Float32Array, at: number, world: Float64Array | null, skin: Float32Array, joint: number): void {
  for (let row = 0; row < 3; row++) {
    for (let column = 0; column < 3; column++) {
      let sum = world === null ? Number(row === column) : (world[4 * column + row] as number);
      if (world !== null && joint >= 0) {
        sum = 0;
        for (let k = 0; k < 3; k++) sum += (world[4 * column + k] as number) * (skin[joint + 4 * k + row] as number);
      }
      out[at + 4 * row + column] = sum;
    }
  }
}
