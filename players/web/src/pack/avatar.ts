// A whole pack: inflated, read, checked.

import type { Avatar, Driving, Skeleton } from "../avatar.js";
import { AvatarError } from "../errors.js";
import { checkProgram } from "./check.js";
import { readClips, type Sizes } from "./clips.js";
import * as facts from "./facts.js";
import { inflate, mostOf } from "./inflate.js";
import type { Interfaces } from "./access.js";
import type { Json } from "./json.js";
import type { Program } from "./model.js";
import { readProgram } from "./program.js";
import { checkGroups, checkJoint, readSkeleton } from "./rig.js";
import { type HeldArray, Tensors } from "./tensors.js";
import { checkVersions } from "./versions.js";

/** The avatar in the bytes of a pack. Throws AvatarError for anything out of order. */
export async function readPack(file: Uint8Array, interfaces: Interfaces): Promise<Avatar> {
  const inflated = await inflate(file);
  const { document } = inflated.header;
  checkVersions(document);
  const tensors = new Tensors(inflated);
  const program = readProgram(document.at("program"), tensors.buffers(document.at("program").at("buffers")));
  const groups = document.at("levels").list(1, 16).map(facts.readGroups);
  checkLevels(program, groups);
  checkProgram(program, (groups[0] as facts.Groups).length, interfaces);
  return readAvatar(document, tensors.arrays(document.at("arrays")), program, groups[0] as facts.Groups, file.length);
}

function readAvatar(
  document: Json,
  arrays: ReadonlyMap<string, HeldArray>,
  program: Program,
  groups: facts.Groups,
  bytes: number,
): Avatar {
  const said = document.at("avatar");
  const expressions = facts.readExpressions(said);
  const eyelids = said.at("late_morphs").names();
  const joints = said.optional("joints", (names) => names.names());
  const skeleton = joints && readSkeleton(arrays, joints, expressions.length, verticesOf(program));
  const sizes = { expressions: expressions.length, late: eyelids.length, joints: joints?.length ?? 0 };
  checkPose(program, sizes, skeleton);
  checkGroups(groups, skeleton);
  const rules = facts.readRules(said);
  checkJoint(rules["rotation_joint"] ?? null, skeleton, "$.avatar.rules.rotation_joint");
  if (rules["rotation"] === "head_bone" && skeleton !== null && (rules["rotation_joint"] ?? null) === null) {
    throw new AvatarError("rule head_bone needs a rotation_joint", { field: "$.avatar.rules.rotation_joint" });
  }
  const driving = facts.readDriving(document);
  checkDriving(driving, expressions.map((one) => one.name), eyelids, skeleton);
  const triangles = arrays.get("rig.triangles");
  const preview = arrays.get("preview");
  const provenance = said.at("provenance");
  const handedness = said.at("frame").at("handedness").one(["right", "left"]);
  return {
    name: said.at("name").name(),
    license: provenance.value === undefined ? null : provenance.optional("licence", statement),
    consent: provenance.value === undefined ? null : provenance.optional("consent", statement),
    handedness,
    expressions,
    eyelids,
    skeleton,
    groups,
    rules,
    clips: readClips(said.at("clips"), arrays, sizes, mostOf(bytes)),
    driving,
    levels: facts.readLevels(document),
    framing: facts.readFraming(document, handedness === "left"),
    bounds: facts.readBounds(said, handedness === "left"),
    background: facts.readBackground(said),
    preview: preview?.values instanceof Uint8Array ? preview.values : null,
    triangles: triangles?.values instanceof Uint32Array ? triangles.values : null,
    bytes,
    program,
  };
}

function statement(said: Json): string | null {
  return typeof said.value === "string" ? said.value : null;
}

/** Vertices of the mesh; 0 if there is none. Its passes have been checked. */
function verticesOf(program: Program): number {
  const vertices = program.mesh.find((one) => "vertices" in one.constants)?.constants["vertices"];
  return typeof vertices === "number" ? vertices : 0;
}

/** Every level has its own rows and all groups of the finest, since group transforms are shared. */
function checkLevels(program: Program, groups: readonly facts.Groups[]): void {
  if (groups.length !== program.levels.length) {
    throw new AvatarError("has another number of levels than $.levels", { field: "$.program.levels" });
  }
  groups.forEach((own, index) => {
    const rows = program.levels[index]?.chunks.reduce((sum, run) => sum + run.count, 0);
    const last = own[own.length - 1];
    if (last === undefined || rows !== last.first + last.count) {
      const field = `$.program.levels[${index}]`;
      throw new AvatarError(`has ${rows} rows, not those of $.levels[${index}]`, { field });
    }
    const finest = groups[0] ?? [];
    const same = own.length === finest.length && own.every((group, i) => group.binding === finest[i]?.binding);
    if (!same) throw new AvatarError("has other groups than the finest level", { field: `$.levels[${index}].groups` });
  });
}

/** Sections of Pose have the floats that stage `joints` gives. */
function checkPose(program: Program, sizes: Sizes, skeleton: Skeleton | null): void {
  const { weights, features, late, joints } = program.pose;
  const wanted: [string, number, number][] = [
    ["weights", features - weights, sizes.expressions],
    ["late", joints - late, sizes.late],
    ["joints", program.poseFloats - joints, 12 * sizes.joints],
  ];
  if (skeleton !== null) wanted.push(["features", late - features, 9 * skeleton.correctiveJoints.length]);
  for (const [name, floats, needed] of wanted) {
    if (floats !== needed) {
      const field = `$.program.pose.${name}`;
      throw new AvatarError(`takes ${floats} floats; the avatar's names need ${needed}`, { field });
    }
  }
}

function checkDriving(
  driving: Driving | null,
  expressions: readonly string[],
  late: readonly string[],
  skeleton: Skeleton | null,
): void {
  if (driving === null) return;
  const known = new Set([
    ...expressions.map((name) => `expression/${name}`),
    ...late.map((name) => `eyelid/${name}`),
    ...(skeleton?.names ?? []).flatMap((name) => ["x", "y", "z"].map((axis) => `joint/${name}/${axis}`)),
  ]);
  for (const output of driving.outputs) {
    if (!known.has(output)) {
      const kinds = "expression/NAME, eyelid/NAME or joint/NAME/x|y|z";
      throw new AvatarError(`'${output.slice(0, 80)}' is no ${kinds} of this avatar`, { field: "driving.outputs" });
    }
  }
  checkJoint(driving.headJoint, skeleton, "driving.head_joint");
  checkJoint(driving.leftEyeJoint, skeleton, "driving.left_eye_joint");
  checkJoint(driving.rightEyeJoint, skeleton, "driving.right_eye_joint");
}
