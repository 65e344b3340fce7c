// One stage alone: its inputs are written to the buffers, its passes run, its outputs are read.

import type { Avatar } from "../avatar.js";
import type { Camera } from "../camera.js";
import type { FrameValues } from "../frame.js";
import type { Level } from "../pack/model.js";
import { Pose } from "../pose/pose.js";
import { Poser } from "../pose/poser.js";
import { LAYOUTS, putRows, shPlace, takeRows, type Place } from "./planes.js";
import type { Numbers, Tensors } from "./reference.js";

const JOINT_FLOATS = 12;

/** A renderer that runs single stages of one avatar. */
export interface StageRunner {
  readonly avatar: Avatar;
  readonly level: Level;
  readonly values: FrameValues;
  write(buffer: string, floats: Float32Array): void;
  read(buffer: string): Promise<Float32Array>;
  /** Runs the passes of a stage with `values`. */
  run(stage: string): Promise<void>;
  /** Ids of the drawn splats, front to back, of what Projected holds. */
  sort(): Promise<Uint32Array>;
  /** The image [H, W, 4] of splats in that order. */
  raster(order: Uint32Array, camera: Camera): Promise<Float32Array>;
  dispose(): void;
}

/** Outputs of a stage by the names of the reference. `camera` is the case's. */
export async function runStage(runner: StageRunner, stage: string, inputs: Tensors, camera: Camera): Promise<Tensors> {
  if (stage === "joints") return joints(runner.avatar, inputs);
  writePose(runner, inputs);
  return (STAGES[stage] as Stage)(runner, inputs, camera);
}

type Stage = (runner: StageRunner, x: Tensors, camera: Camera) => Promise<Tensors>;

const STAGES: Readonly<Record<string, Stage>> = {
  async morph(runner) {
    await runner.run("morph");
    return { vertices: await readMesh(runner) };
  },
  async skin(runner, x) {
    writeMesh(runner, x["vertices"] as Numbers);
    await runner.run("skin");
    return { posed_vertices: await readMesh(runner) };
  },
  async blend(runner) {
    await runner.run("blend");
    const taken = await take(runner, "Splats", ["mean", "log_scale", "quat_wxyz", "opacity_logit"]);
    return { ...taken, ...(await takeFrom(runner, "Sh", { sh: shPlace(termsOf(runner)) })) };
  },
  async bind(runner, x) {
    put(runner, "Splats", x);
    setTransforms(runner.values, x);
    if (runner.avatar.program.readsMesh) writeMesh(runner, x["posed_vertices"] as Numbers);
    await runner.run("bind");
    return take(runner, "Splats", ["mean", "log_scale", "quat_wxyz", "sh_rotation"]);
  },
  async activate(runner, x) {
    put(runner, "Splats", x);
    await runner.run("activate");
    return take(runner, "Splats", ["scale", "quat_wxyz", "opacity"]);
  },
  async project(runner, x, camera) {
    put(runner, "Splats", x);
    runner.values.setCamera(camera, IDENTITY);
    await runner.run("project");
    const taken = await take(runner, "Projected", Object.keys(LAYOUTS.Projected.places));
    return { ...taken, radius: Int32Array.from(taken["radius"] as Float32Array) };
  },
  async shadow(runner, x) {
    put(runner, "Splats", x);
    if (x["posed_vertices"] !== undefined) writeMesh(runner, x["posed_vertices"]);
    setTransforms(runner.values, x);
    setLight(runner.values, x);
    await runner.run("shadow");
    return { shadow: await runner.read("Shadow") };
  },
  async light(runner, x) {
    if (x["posed_vertices"] !== undefined) {
      writeMesh(runner, x["posed_vertices"]);
      setTransforms(runner.values, x);
      await runner.run("bind"); // turns triangles
    }
    put(runner, "Splats", x);
    put(runner, "Projected", x);
    setLight(runner.values, x);
    if (x["shadow"] !== undefined) runner.write("Shadow", x["shadow"] as Float32Array);
    await runner.run("light");
    return take(runner, "Projected", ["rgb"]);
  },
  async sort(runner, x) {
    put(runner, "Projected", x);
    return { order: await runner.sort() };
  },
  async raster(runner, x, camera) {
    put(runner, "Projected", x);
    const image = await runner.raster(Uint32Array.from(x["order"] as BigInt64Array, Number), camera);
    return over(image, x["background"] as Numbers);
  },
};
const IDENTITY = new Float64Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);

function joints(avatar: Avatar, x: Tensors): Tensors {
  const pose = new Pose(avatar);
  pose.expressionWeights.set(x["expression_weights"] as Float32Array);
  pose.jointDelta.set(x["joint_delta"] as Float64Array);
  if (x["late_weights"] !== undefined) pose.lateWeights.set(x["late_weights"] as Float32Array);
  const posed = new Poser(avatar).update(pose);
  const { pose: at, poseFloats } = avatar.program;
  const count = (poseFloats - at.joints) / JOINT_FLOATS;
  const skin = new Float32Array(16 * count);
  for (let j = 0; j < count; j++) {
    skin.set(posed.poseFloats.subarray(at.joints + JOINT_FLOATS * j, at.joints + JOINT_FLOATS * (j + 1)), 16 * j);
    skin[16 * j + 15] = 1;
  }
  const rotation = new Float32Array(9 * avatar.groups.length);
  for (let i = 0; i < rotation.length; i++) {
    rotation[i] = posed.groupRotation[12 * Math.floor(i / 9) + 4 * Math.floor((i % 9) / 3) + (i % 3)] as number;
  }
  return {
    skin_matrix: skin,
    pose_feature: posed.poseFloats.slice(at.features, at.late),
    group_matrix: posed.groupMatrix.slice(),
    group_rotation: rotation,
  };
}

/** Buffer Pose; arrays that are not given are 0. */
function writePose(runner: StageRunner, x: Tensors): void {
  const { pose, poseFloats } = runner.avatar.program;
  if (poseFloats === 0) return;
  const floats = new Float32Array(poseFloats);
  const put = (name: string, at: number): void => {
    if (x[name] !== undefined) floats.set(Float32Array.from(x[name] as Float32Array), at);
  };
  put("expression_weights", pose.weights);
  put("pose_feature", pose.features);
  put("late_weights", pose.late);
  const skin = x["skin_matrix"] as Float32Array | undefined;
  for (let j = 0; skin !== undefined && 16 * j < skin.length; j++) {
    floats.set(Float32Array.from(skin.subarray(16 * j, 16 * j + JOINT_FLOATS)), pose.joints + JOINT_FLOATS * j);
  }
  runner.write("Pose", floats);
}

function setTransforms(values: FrameValues, x: Tensors): void {
  const matrix = Float32Array.from((x["group_matrix"] as Float32Array | undefined) ?? new Float32Array(12 * values.groups));
  const small = (x["group_rotation"] as Float32Array | undefined) ?? EMPTY;
  const rotation = new Float32Array(matrix.length);
  for (let i = 0; i < small.length; i++) {
    rotation[12 * Math.floor(i / 9) + 4 * Math.floor((i % 9) / 3) + (i % 3)] = small[i] as number;
  }
  const world = Float64Array.from(x["world_from_avatar"] as Float64Array);
  values.setPosed({ poseFloats: EMPTY, groupMatrix: matrix, groupRotation: rotation, worldFromAvatar: world });
}
const EMPTY = new Float32Array(0);

const OF_LIGHT = {
  light_ambient: "light_ambient0",
  light_place: "light_place0",
  light_colour: "light_colour0",
  light_turn: "light_turn_row0",
  shadow_row: "shadow_row0",
  shadow_offset: "shadow_offset",
};

/** The numbers of a light; arrays that are not given are 0. */
function setLight({ floats, layout, lightAt }: FrameValues, x: Tensors): void {
  floats.fill(0, lightAt, layout.lit);
  for (const [name, first] of Object.entries(OF_LIGHT)) {
    if (x[name] !== undefined) floats.set(x[name] as Float32Array, layout.first[first] as number);
  }
}

function writeMesh(runner: StageRunner, vertices: Numbers): void {
  const count = vertices.length / 3;
  const floats = new Float32Array(4 * count).fill(1);
  for (let i = 0; i < vertices.length; i++) floats[4 * Math.floor(i / 3) + (i % 3)] = Number(vertices[i]);
  runner.write("Mesh", floats);
}

async function readMesh(runner: StageRunner): Promise<Float32Array> {
  const first = runner.avatar.program.mesh[0];
  const count = Number(first?.constants["vertices"] ?? 0);
  const plane = await runner.read("Mesh");
  return Float32Array.from({ length: 3 * count }, (_, i) => plane[4 * Math.floor(i / 3) + (i % 3)] as number);
}

/** Writes what is given of the arrays of a buffer, chunk by chunk; with Splats, Sh. */
function put(runner: StageRunner, kind: "Splats" | "Projected", x: Tensors): void {
  const { planes, places } = LAYOUTS[kind];
  putInto(runner, kind, places, 4 * planes, x);
  const sh = shPlace(termsOf(runner));
  if (kind === "Splats" && x["sh"] !== undefined) putInto(runner, "Sh", { sh }, sh.components, x);
}

function putInto(runner: StageRunner, buffer: string, places: Readonly<Record<string, Place>>, floatsOfRow: number, x: Tensors): void {
  runner.level.chunks.forEach((chunk, i) => {
    const floats = new Float32Array(floatsOfRow * chunk.count);
    for (const [name, place] of Object.entries(places)) {
      if (x[name] !== undefined) putRows(floats, place, x[name] as Numbers, chunk);
    }
    runner.write(`${runner.level.prefix}${buffer}.${i}`, floats);
  });
}

function take(runner: StageRunner, kind: "Splats" | "Projected", names: readonly string[]): Promise<Record<string, Numbers>> {
  const { places } = LAYOUTS[kind];
  return takeFrom(runner, kind, Object.fromEntries(names.map((name) => [name, places[name] as Place])));
}

async function takeFrom(runner: StageRunner, buffer: string, places: Readonly<Record<string, Place>>): Promise<Record<string, Numbers>> {
  const rows = runner.level.chunks.reduce((sum, chunk) => sum + chunk.count, 0);
  const found: Record<string, Float32Array> = {};
  for (const [name, { components }] of Object.entries(places)) found[name] = new Float32Array(rows * components);
  for (const [i, chunk] of runner.level.chunks.entries()) {
    const floats = await runner.read(`${runner.level.prefix}${buffer}.${i}`);
    for (const [name, place] of Object.entries(places)) takeRows(floats, place, found[name] as Float32Array, chunk);
  }
  return found;
}

function termsOf(runner: StageRunner): number {
  return Number(runner.level.deform[0]?.constants["sh_terms"] ?? 1);
}

function over(image: Float32Array, background: Numbers): Tensors {
  const pixels = image.length / 4;
  const colour = new Float32Array(3 * pixels);
  const transmittance = new Float32Array(pixels);
  for (let i = 0; i < pixels; i++) {
    const left = 1 - (image[4 * i + 3] as number);
    transmittance[i] = left;
    for (let c = 0; c < 3; c++) colour[3 * i + c] = (image[4 * i + c] as number) + left * Number(background[c]);
  }
  return { colour, transmittance };
}
