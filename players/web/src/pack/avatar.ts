// A whole pack: inflated, read, checked.

import type { Avatar, Driving, Skeleton } from "../avatar.js";
import { AvatarError } from "../errors.js";
import { loadLight } from "../light/lazy.js";
import type { Interfaces } from "./access.js";
import { checkProgram } from "./check.js";
import { readClips, type Sizes } from "./clips.js";
import type { Document } from "./document.js";
import * as facts from "./facts.js";
import { checkForm } from "./form.js";
import { inflate, mostDecodedOf, mostOf } from "./inflate.js";
import { shown } from "./json.js";
import type { Buffer, Program } from "./model.js";
import { checkGroups, checkJoint, readSkeleton, readTriangles } from "./rig.js";
import { type HeldArray, Tensors } from "./tensors.js";
import { checkShaders, checkVersions } from "./versions.js";

/** The avatar in the bytes of a pack. Throws AvatarError for anything out of order. */
export async function readPack(file: Uint8Array, interfaces: Interfaces): Promise<Avatar> {
  const inflated = await inflate(file);
  const said = inflated.header.document;
  checkVersions(said);
  checkForm(said);
  const document = said as unknown as Document;
  checkShaders(document.shaders);
  const tensors = new Tensors(inflated, mostDecodedOf(file.length));
  const program = readProgram(document.program, tensors.buffers(document.program.buffers));
  checkLevels(program, document.levels);
  const groups = document.levels.map(facts.readGroups);
  checkBindings(groups);
  checkProgram(program, (groups[0] as facts.Groups).length, interfaces, file.length);
  checkRelight(program, document.avatar);
  if (document.avatar.relight !== undefined) await loadLight();
  return readAvatar(document, tensors.arrays(document.arrays), program, groups[0] as facts.Groups, file.length);
}

function readProgram(said: Document["program"], buffers: ReadonlyMap<string, Buffer>): Program {
  const { mesh, levels, pose, pose_floats: poseFloats, reads_mesh: readsMesh } = said;
  const read = ({ prefix, chunks, deform, view, shadow = [], light = [] }: (typeof levels)[number]): Program["levels"][number] => {
    return { prefix, chunks: chunks.map(([first, count]) => ({ first, count })), deform, view, shadow, light };
  };
  return { buffers, mesh, levels: levels.map(read), pose, poseFloats, readsMesh };
}

function readAvatar(
  document: Document,
  arrays: ReadonlyMap<string, HeldArray>,
  program: Program,
  groups: facts.Groups,
  bytes: number,
): Avatar {
  const said = document.avatar;
  const { name, joints, late_morphs: eyelids, provenance, frame: { handedness } } = said;
  const expressions = facts.readExpressions(said);
  const vertices = verticesOf(program);
  const skeleton = joints && readSkeleton(arrays, joints, expressions.length, vertices);
  const sizes = { expressions: expressions.length, late: eyelids.length, joints: joints?.length ?? 0 };
  checkPose(program, sizes, skeleton);
  checkGroups(groups, skeleton);
  const rules = facts.readRules(said);
  checkJoint(rules["rotation_joint"] ?? null, skeleton, "$.avatar.rules.rotation_joint");
  if (rules["rotation"] === "head_bone" && (rules["rotation_joint"] ?? null) === null) {
    throw new AvatarError("rule head_bone needs a rotation_joint", { field: "$.avatar.rules.rotation_joint" });
  }
  const driving = facts.readDriving(document);
  checkDriving(driving, expressions.map((one) => one.name), eyelids, skeleton);
  const preview = arrays.get("preview")?.values;
  return {
    name,
    license: statement(provenance.licence),
    consent: statement(provenance.consent),
    handedness,
    expressions,
    eyelids,
    skeleton,
    groups,
    rules,
    clips: readClips(said, arrays, sizes, mostOf(bytes)),
    driving,
    levels: facts.readLevels(document),
    framing: facts.readFraming(document, handedness === "left"),
    bounds: facts.readBounds(said, handedness === "left"),
    background: facts.readBackground(said),
    preview: preview instanceof Uint8Array ? preview : null,
    relight: facts.readRelight(said, skeleton),
    triangles: skeleton && !program.readsMesh ? readTriangles(arrays, vertices) : null,
    bytes,
    program,
  };
}

function statement(said: unknown): string | null {
  return typeof said === "string" ? said : null;
}

/** Vertices of the mesh; 0 if there is none. Its passes have been checked. */
function verticesOf(program: Program): number {
  const vertices = program.mesh.find((one) => "vertices" in one.constants)?.constants["vertices"];
  return typeof vertices === "number" ? vertices : 0;
}

/** Every level has the rows of its chunks. */
function checkLevels(program: Program, levels: Document["levels"]): void {
  if (levels.length !== program.levels.length) {
    throw new AvatarError("has another number of levels than $.levels", { field: "$.program.levels" });
  }
  levels.forEach(({ count }, index) => {
    const rows = program.levels[index]?.chunks.reduce((sum, run) => sum + run.count, 0);
    if (rows !== count) throw new AvatarError(`is ${count}; its chunks have ${rows} rows`, { field: `$.levels[${index}].count` });
  });
}

/** Every level has passes of stage light where the manifest says in what light the avatar was captured, and nowhere else. */
function checkRelight(program: Program, { relight }: Document["avatar"]): void {
  if (program.levels.every(({ light }) => light.length > 0 === (relight !== undefined))) return;
  throw new AvatarError("goes with passes of stage light, and they with it", { field: "$.avatar.relight" });
}

/** Every level has all groups of the finest, since group transforms are shared. */
function checkBindings(groups: readonly facts.Groups[]): void {
  const finest = groups[0] ?? [];
  groups.forEach((own, index) => {
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
      throw new AvatarError(`${shown(output)} is no ${kinds} of this avatar`, { field: "driving.outputs" });
    }
  }
  checkJoint(driving.headJoint, skeleton, "driving.head_joint");
  checkJoint(driving.leftEyeJoint, skeleton, "driving.left_eye_joint");
  checkJoint(driving.rightEyeJoint, skeleton, "driving.right_eye_joint");
}
