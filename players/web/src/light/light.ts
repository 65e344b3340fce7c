// What a light of a scene is, as people and files say it (SPEC.md, section 19).

type Three = readonly [number, number, number];

/** A light from one direction or from one point. Only the first of a scene casts a shadow. */
export type DirectLight =
  /** `direction`: towards the light, of any length. `colour`: linear, what a white matt surface reflects that faces it. */
  | { readonly direction: Three; readonly colour: Three }
  /** `position` in metres. `colour`: the same from 1 m away; it falls with the square of the distance. */
  | { readonly position: Three; readonly colour: Three };

/** The light of a scene, in its space: right-handed, metres, +Y up. Colours are linear. */
export interface Light {
  /** What a white matt surface reflects: one colour for every normal, or nine, the terms of SH of its normal. */
  readonly ambient?: Three | readonly Three[];
  /** Up to four. */
  readonly lights?: readonly DirectLight[];
  /** Whether the first of `lights` casts a shadow. */
  readonly shadow?: boolean;
}
