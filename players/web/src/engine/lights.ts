// The lights of a host's scene, and what of them falls on an avatar.

import type { Relight } from "../avatar.js";
import type { Instance } from "../instance.js";
import type { Lighting } from "../light/lighting.js";
import { MOST_LIGHTS } from "../light/said.js";
import { SH_C0, SH_C1 } from "../made/constants.js";

type Colour = { readonly r: number; readonly g: number; readonly b: number };
type Vector = { readonly x: number; readonly y: number; readonly z: number };

/** How a host's lights fall off: `cone` of cosines, `distance` in its units with the numbers that `direct` was given. */
export interface Falloff {
  distance(distance: number, range: number, kind: number): number;
  cone(cosine: number, outer: number, inner: number): number;
}

const FLOATS = 15; // of a light: place, whether it is a point, colour, whether it casts, range, kind, spot direction, outer, inner
const POINT = 3, COLOUR = 4, CASTS = 7, RANGE = 8, KIND = 9, SPOT = 10, OUTER = 13, INNER = 14;
const NO_CONE = -2; // less than any cosine
const NEAREST = 1e-6; // of the host: there is no direction to a light from its own place
const CENTRE = new Float64Array(3);
const POSED = new Float64Array(3);
const CHOSEN = new Int32Array(MOST_LIGHTS);
const STRENGTH = new Float64Array(MOST_LIGHTS);

/** The cone of a spot light that is smooth between two cosines, as smoothstep of shaders. */
export function smooth(cosine: number, outer: number, inner: number): number {
  const part = Math.min(1, Math.max(0, (cosine - outer) / (inner - outer)));
  return part * part * (3 - 2 * part);
}

/** Collects lights in the host's world; colours are what a white matt surface reflects. Allocates only for more lights. */
export class SceneLights {
  private readonly ambient = new Float64Array(27);
  private rows = new Float64Array(FLOATS * MOST_LIGHTS);
  private count = 0;
  private any = false;

  constructor(private readonly falloff: Falloff) {}

  /** Forgets all lights. */
  begin(): void {
    this.ambient.fill(0);
    this.count = 0;
    this.any = false;
  }

  /** Light that is the same for all normals. */
  even({ r, g, b }: Colour, scale: number): void {
    this.any = true;
    this.term(0, r, g, b, scale / (SH_C0[0] as number));
  }

  /** From `ground` to `sky` by the cosine of a normal and `up`, of length 1. */
  hemisphere(up: Vector, sky: Colour, ground: Colour, scale: number): void {
    this.even(sky, scale / 2);
    this.even(ground, scale / 2);
    const r = (sky.r - ground.r) / 2, g = (sky.g - ground.g) / 2, b = (sky.b - ground.b) / 2;
    this.term(1, r, g, b, (scale * up.y) / (SH_C1[0] as number));
    this.term(2, r, g, b, (scale * up.z) / (SH_C1[1] as number));
    this.term(3, r, g, b, (scale * up.x) / (SH_C1[2] as number));
  }

  /** A term of the SH of ambient light, as `Light.ambient` has it. */
  term(k: number, r: number, g: number, b: number, scale: number): void {
    this.any = true;
    this.ambient[3 * k] = (this.ambient[3 * k] as number) + scale * r;
    this.ambient[3 * k + 1] = (this.ambient[3 * k + 1] as number) + scale * g;
    this.ambient[3 * k + 2] = (this.ambient[3 * k + 2] as number) + scale * b;
  }

  /** A light from one direction: `towards` it, of any length. */
  direct(towards: Vector, colour: Colour, scale: number, casts: boolean): void {
    this.add(towards, 0, colour, scale, casts);
  }

  /** A light from one point; `scale` is at a distance where the host's falloff is 1. */
  point(at: Vector, colour: Colour, scale: number, casts: boolean, range: number, kind: number): void {
    const row = this.add(at, 1, colour, scale, casts);
    this.rows[row + RANGE] = range;
    this.rows[row + KIND] = kind;
  }

  /** Makes the light that was added last one with a cone: `towards` it from what it shines on, and cosines. */
  spot(towards: Vector, outer: number, inner: number): void {
    const row = FLOATS * (this.count - 1);
    const length = Math.sqrt(towards.x ** 2 + towards.y ** 2 + towards.z ** 2);
    this.rows[row + SPOT] = towards.x / length;
    this.rows[row + SPOT + 1] = towards.y / length;
    this.rows[row + SPOT + 2] = towards.z / length;
    this.rows[row + OUTER] = outer;
    this.rows[row + INNER] = inner;
  }

  /** Lights a placed and posed instance, with the strongest lights where it stands. Without any light it is as trained. */
  shineOn(instance: Instance): void {
    if (instance.avatar.relight === null) return;
    if (!this.any) {
      if (instance.isLit) instance.light = null;
      return;
    }
    const lighting = instance.lit();
    setCentre(instance, instance.avatar.relight);
    lighting.ambient.set(this.ambient);
    this.choose();
    lighting.count = Math.min(this.count, MOST_LIGHTS);
    for (let k = 0; k < lighting.count; k++) this.write(lighting, k, FLOATS * (CHOSEN[k] as number));
    lighting.shadow = lighting.count > 0 && this.rows[FLOATS * (CHOSEN[0] as number) + CASTS] === 1;
  }

  private add(place: Vector, point: 0 | 1, { r, g, b }: Colour, scale: number, casts: boolean): number {
    this.any = true;
    const row = FLOATS * this.count++;
    if (row === this.rows.length) {
      const more = new Float64Array(2 * row);
      more.set(this.rows);
      this.rows = more;
    }
    const { rows } = this;
    rows[row] = place.x;
    rows[row + 1] = place.y;
    rows[row + 2] = place.z;
    rows[row + POINT] = point;
    rows[row + COLOUR] = r * scale;
    rows[row + COLOUR + 1] = g * scale;
    rows[row + COLOUR + 2] = b * scale;
    rows[row + CASTS] = casts ? 1 : 0;
    rows[row + OUTER] = NO_CONE;
    return row;
  }

  /** Writes the strongest lights at CENTRE into CHOSEN, strongest first; before them the strongest that casts a shadow. */
  private choose(): void {
    STRENGTH.fill(-1);
    for (let i = 0; i < this.count; i++) this.insert(i);
    let caster = -1, most = 0;
    for (let i = 0; i < this.count; i++) {
      const strength = this.rows[FLOATS * i + CASTS] === 1 ? this.strength(FLOATS * i) : 0;
      if (strength > most) {
        most = strength;
        caster = i;
      }
    }
    if (caster < 0) return;
    let at = Math.min(this.count, MOST_LIGHTS) - 1;
    for (let k = 0; k < at; k++) if (CHOSEN[k] === caster) at = k;
    CHOSEN.copyWithin(1, 0, at);
    CHOSEN[0] = caster;
  }

  /** Puts a light among the chosen, by its strength. */
  private insert(light: number): void {
    let strength = this.strength(FLOATS * light);
    let one = light;
    for (let k = 0; k < MOST_LIGHTS; k++) {
      if (strength <= (STRENGTH[k] as number)) continue;
      const other = CHOSEN[k] as number, weaker = STRENGTH[k] as number;
      CHOSEN[k] = one;
      STRENGTH[k] = strength;
      one = other;
      strength = weaker;
    }
  }

  private strength(row: number): number {
    const { rows } = this;
    const colour = Math.max(rows[row + COLOUR] as number, rows[row + COLOUR + 1] as number, rows[row + COLOUR + 2] as number);
    return colour * this.reaching(row);
  }

  /** What of a light's colour reaches CENTRE. */
  private reaching(row: number): number {
    const { rows } = this;
    if (rows[row + POINT] === 0) return 1;
    const distance = this.distance(row);
    const falloff = this.falloff.distance(distance, rows[row + RANGE] as number, rows[row + KIND] as number);
    if (rows[row + OUTER] === NO_CONE) return falloff;
    let cosine = 0;
    for (let i = 0; i < 3; i++) cosine += (((rows[row + i] as number) - (CENTRE[i] as number)) / distance) * (rows[row + SPOT + i] as number);
    return falloff * this.falloff.cone(cosine, rows[row + OUTER] as number, rows[row + INNER] as number);
  }

  private distance(row: number): number {
    let sum = 0;
    for (let i = 0; i < 3; i++) sum += ((this.rows[row + i] as number) - (CENTRE[i] as number)) ** 2;
    return Math.max(Math.sqrt(sum), NEAREST);
  }

  /** Around CENTRE a point light falls with the square of the distance, at CENTRE it is what the host's falloff makes it. */
  private write(lighting: Lighting, k: number, row: number): void {
    const { rows } = this;
    const point = rows[row + POINT] as number;
    const scale = point === 1 ? this.reaching(row) * this.distance(row) ** 2 : 1;
    for (let i = 0; i < 3; i++) {
      lighting.places[4 * k + i] = rows[row + i] as number;
      lighting.colours[3 * k + i] = (rows[row + COLOUR + i] as number) * scale;
    }
    lighting.places[4 * k + 3] = point;
  }
}

/** CENTRE = the middle of what casts shadows, in the host's world. */
function setCentre({ place, pose, avatar: { handedness } }: Instance, { centre }: Relight): void {
  const side = handedness === "left" ? -1 : 1; // of x of the pack's frame, in that of `place`
  const x = centre[0], y = centre[1], z = centre[2];
  const world = pose.worldFromAvatar;
  for (let row = 0; row < 3; row++) {
    const at = 4 * row;
    POSED[row] = (world[at] as number) * x + (world[at + 1] as number) * y + (world[at + 2] as number) * z + (world[at + 3] as number);
  }
  for (let row = 0; row < 3; row++) {
    const at = 4 * row;
    const across = (place[at] as number) * side * (POSED[0] as number);
    CENTRE[row] = across + (place[at + 1] as number) * (POSED[1] as number) + (place[at + 2] as number) * (POSED[2] as number) + (place[at + 3] as number);
  }
}
