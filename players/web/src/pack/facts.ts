// What a document says of an avatar without arrays: names, rules, driving, levels, framing.

import type { Driving, Expression, Framing, Group, LevelInfo, Relight, Skeleton } from "../avatar.js";
import { AvatarError } from "../errors.js";
import { checkJoint } from "./rig.js";
import type { AvatarText, Box, Difference, Document, Framed, Linear, Vector } from "./document.js";

export type Groups = readonly Group[];
const MARGIN = 1.08; // of a frame about a box

/** Expressions in column order. */
export function readExpressions({ expressions }: AvatarText): Expression[] {
  if (new Set(expressions.map((one) => one.name)).size !== expressions.length) {
    throw new AvatarError("has a name twice", { field: "$.avatar.expressions" });
  }
  return expressions.map(({ name, aliases = [], range }) => ({ name, aliases, range }));
}

/** Rules by name; numbers and other kinds of values are left out. */
export function readRules({ rules }: AvatarText): Record<string, string | null> {
  const found = Object.create(null) as Record<string, string | null>;
  for (const [name, value] of Object.entries(rules)) {
    if (typeof value === "string" || value === null) found[name] = value;
  }
  return found;
}

/** The groups of a level, which cover its `count` rows in order. */
export function readGroups({ count, groups }: Document["levels"][number], level: number): Group[] {
  const field = `$.levels[${level}].groups`;
  let next = 0;
  const found = groups.map((group, index) => {
    if (group.first !== next) {
      const message = `covers ${group.first}+${group.count}, but row ${next} comes next`;
      throw new AvatarError(message, { field: `${field}[${index}]` });
    }
    next += group.count;
    const jointMix = Object.assign(Object.create(null), group.joint_mix) as Record<string, number>;
    return { name: group.name, first: group.first, count: group.count, binding: group.binding, jointMix };
  });
  if (next !== count) throw new AvatarError(`cover ${next} of ${count} Gaussians`, { field });
  return found;
}

/** How ARKit drives the avatar; null if it cannot. */
export function readDriving({ avatar: { driving: said }, driving: spelled }: Document): Driving | null {
  // The manifest's own matrix is in the frame of the pack; `driving` of the document spells out mode "names".
  const linear = said.mode === "matrix" ? said : spelled;
  if (said.mode === "none" || linear === undefined) return null;
  const { inputs = [], outputs = [], matrix } = linear;
  return {
    inputs,
    outputs,
    matrix: readMatrix(matrix ?? [], outputs.length, inputs.length, said.mode === "matrix" ? "$.avatar" : "$"),
    headJoint: said.head_joint ?? null,
    headPivot: said.head_pivot ?? [0, 0, 0],
    leftEyeJoint: said.left_eye_joint ?? null,
    rightEyeJoint: said.right_eye_joint ?? null,
  };
}

function readMatrix(said: Linear["matrix"], rows: number, columns: number, where: string): Float64Array {
  const fits = (items: readonly unknown[], length: number, at: string): void => {
    if (items.length === length) return;
    throw new AvatarError(`has ${items.length} items; ${length} are needed`, { field: `${where}.driving.matrix${at}` });
  };
  fits(said, rows, "");
  said.forEach((row, r) => fits(row, columns, `[${r}]`));
  return Float64Array.from(said.flat(), Math.fround);
}

/** Levels of detail, finest first. */
export function readLevels(document: Document): LevelInfo[] {
  return document.levels.map(({ count, height_px: heightPx, error }, index) => ({
    count,
    heightPx: heightPx ?? null,
    psnrDb: psnrInMask(index === 0 ? document.error : error),
  }));
}

function psnrInMask(error: Difference | undefined): number | null {
  return error?.psnr_mask_db?.mean ?? null;
}

/** The box that culling uses, right-handed. */
export function readBounds({ bounds: { swept } }: AvatarText, left: boolean): { low: Vector; high: Vector } {
  const { min, max } = swept;
  return left ? { low: [-max[0], min[1], min[2]], high: [-min[0], max[1], max[2]] } : { low: min, high: max };
}

/** Where to look, right-handed. Without a stated frame, it is the box at rest. */
export function readFraming({ avatar, framing }: Document, left: boolean): Framing {
  const turned = ([x, y, z]: Vector): Vector => [left ? -x : x, y, z];
  const part = ({ target, size }: Framed): Framed => ({ target: turned(target), size });
  return {
    up: turned(framing?.up ?? [0, 1, 0]),
    front: turned(framing?.front ?? [0, 0, 1]),
    whole: part(framing?.whole ?? around(avatar.bounds.rest)),
    head: framing?.head ? part(framing.head) : null,
  };
}

function around({ min, max }: Box): Framed {
  const of = (pick: (low: number, high: number) => number): Vector => [
    pick(min[0], max[0]),
    pick(min[1], max[1]),
    pick(min[2], max[2]),
  ];
  return { target: of((low, high) => (low + high) / 2), size: of((low, high) => (high - low) * MARGIN) };
}

/** The light of the capture; null where no light of a scene can replace it. */
export function readRelight({ relight }: AvatarText, skeleton: Skeleton | null): Relight | null {
  if (relight === undefined) return null;
  checkJoint(relight.joint ?? null, skeleton, "$.avatar.relight.joint");
  return { ...relight, joint: relight.frame === "head" ? (relight.joint ?? null) : null };
}

/** The background of training; null if it was not one colour. */
export function readBackground({ background }: AvatarText): Vector | null {
  return typeof background === "string" ? null : background;
}
