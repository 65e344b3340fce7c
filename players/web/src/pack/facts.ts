// What a document says of an avatar without arrays: names, rules, driving, levels, framing.

import type { Driving, Expression, Framing, Group, LevelInfo } from "../avatar.js";
import { AvatarError } from "../errors.js";
import type { Json } from "./json.js";

export type Groups = readonly Group[];
const BINDINGS = ["skin", "anchor", "joint_mix", "surface", "none"] as const;
const MARGIN = 1.08; // of a frame about a box

/** Expressions in column order. */
export function readExpressions(avatar: Json): Expression[] {
  const found = avatar.at("expressions").list(0, 65535).map((said) => {
    const [low, high] = said.at("range").list(2, 2).map((end) => end.number());
    const aliases = said.optional("aliases", (names) => names.names()) ?? [];
    return { name: said.at("name").name(), aliases, range: [low as number, high as number] as const };
  });
  if (new Set(found.map((one) => one.name)).size !== found.length) {
    throw new AvatarError("has a name twice", { field: "$.avatar.expressions" });
  }
  return found;
}

/** Rules by name; numbers and other kinds of values are left out. */
export function readRules(avatar: Json): Record<string, string | null> {
  const found = Object.create(null) as Record<string, string | null>;
  for (const [name, said] of avatar.at("rules").entries()) {
    if (typeof said.value === "string" || said.value === null) found[name] = said.value;
  }
  return found;
}

/** The groups of a level, which cover its `count` rows in order. */
export function readGroups(level: Json): Group[] {
  const count = level.at("count").whole(1);
  let next = 0;
  const groups = level.at("groups").list(1).map((said) => {
    const group = readGroup(said);
    if (group.first !== next || group.count < 1) {
      throw new AvatarError(`covers ${group.first}+${group.count}, but row ${next} comes next`, { field: said.path });
    }
    next += group.count;
    return group;
  });
  if (next !== count) throw new AvatarError(`cover ${next} of ${count} Gaussians`, { field: level.at("groups").path });
  return groups;
}

function readGroup(said: Json): Group {
  const jointMix = Object.create(null) as Record<string, number>;
  for (const [joint, factor] of said.optional("joint_mix", (mix) => mix.entries()) ?? []) {
    jointMix[joint] = factor.number();
  }
  return {
    name: said.at("name").name(),
    first: said.at("first").whole(),
    count: said.at("count").whole(),
    binding: said.at("binding").one(BINDINGS),
    jointMix,
  };
}

/** How ARKit drives the avatar; null if it cannot. */
export function readDriving(document: Json): Driving | null {
  const avatar = document.at("avatar").at("driving");
  const mode = avatar.at("mode").one(["names", "matrix", "none"]);
  // The manifest's own matrix is in the frame of the pack; `driving` of the document spells out mode "names".
  const linear = mode === "matrix" ? avatar : document.at("driving");
  if (mode === "none" || linear.value === undefined) return null;
  const inputs = linear.at("inputs").names();
  const outputs = linear.at("outputs").names();
  const joint = (name: string): string | null => avatar.optional(name, (said) => said.name());
  return {
    inputs,
    outputs,
    matrix: readMatrix(linear.at("matrix"), outputs.length, inputs.length),
    headJoint: joint("head_joint"),
    headPivot: avatar.optional("head_pivot", (said) => said.vector()) ?? [0, 0, 0],
    leftEyeJoint: joint("left_eye_joint"),
    rightEyeJoint: joint("right_eye_joint"),
  };
}

function readMatrix(said: Json, rows: number, columns: number): Float64Array {
  const matrix = new Float64Array(rows * columns);
  said.list(rows, rows).forEach((row, r) => {
    row.list(columns, columns).forEach((value, c) => {
      matrix[r * columns + c] = Math.fround(value.number());
    });
  });
  return matrix;
}

/** Levels of detail, finest first. */
export function readLevels(document: Json): LevelInfo[] {
  return document.at("levels").list(1, 16).map((said, index) => ({
    count: said.at("count").whole(1),
    heightPx: said.optional("height_px", (height) => height.number()),
    psnrDb: (index === 0 ? document : said).optional("error", psnrInMask),
  }));
}

function psnrInMask(error: Json): number | null {
  return error.optional("psnr_mask_db", (psnr) => psnr.optional("mean", (mean) => mean.number()));
}

/** The box that culling uses, right-handed. */
export function readBounds(avatar: Json, left: boolean): { low: Vector; high: Vector } | null {
  const box = avatar.optional("bounds", (bounds) => readBox(bounds.at("swept")));
  if (box === null || !left) return box;
  const [x, y, z] = box.low, [right, top, front] = box.high;
  return { low: [-right, y, z], high: [-x, top, front] };
}

type Vector = [number, number, number];

function readBox(said: Json): { low: Vector; high: Vector } {
  return { low: said.at("min").vector(), high: said.at("max").vector() };
}

/** Where to look, right-handed. Without a stated frame, it is the box at rest. */
export function readFraming(document: Json, left: boolean): Framing {
  const turned = ([x, y, z]: Vector): Vector => [left ? -x : x, y, z];
  const part = (said: Json): { target: Vector; size: Vector } => ({
    target: turned(said.at("target").vector()),
    size: said.at("size").vector(),
  });
  const framing = document.optional("framing", (said) => ({
    up: turned(said.at("up").vector()),
    front: turned(said.at("front").vector()),
    whole: said.optional("whole", part),
    head: said.optional("head", part),
  }));
  const rest = aroundRest(document.at("avatar"));
  const whole = framing?.whole ?? { ...rest, target: turned(rest.target) };
  return { up: framing?.up ?? [0, 1, 0], front: framing?.front ?? [0, 0, 1], whole, head: framing?.head ?? null };
}

function aroundRest(avatar: Json): { target: Vector; size: Vector } {
  const box = avatar.optional("bounds", (bounds) => readBox(bounds.at("rest")));
  const low = box?.low ?? [-0.5, -0.5, -0.5];
  const high = box?.high ?? [0.5, 0.5, 0.5];
  const of = (pick: (low: number, high: number) => number): Vector => [
    pick(low[0], high[0]),
    pick(low[1], high[1]),
    pick(low[2], high[2]),
  ];
  return { target: of((a, b) => (a + b) / 2), size: of((a, b) => (b - a) * MARGIN) };
}

/** The background of training; null if it was not one colour. */
export function readBackground(avatar: Json): Vector | null {
  const said = avatar.at("background");
  return typeof said.value === "string" ? null : said.vector();
}
