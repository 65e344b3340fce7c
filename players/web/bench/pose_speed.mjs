// Time of a pose in JavaScript, in Node: npm run pose-speed.
//
// A head with 5 joints, 51 expressions and anchors, and a chain of 262 joints.
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { bundle } from "../bundle.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
const TURNS = 2000;
const ROUNDS = 9;
const text = `export { load } from "./load.ts"; export { Pose } from "./pose/pose.ts"; export { Poser } from "./pose/poser.ts";`;
const { outputFiles } = await bundle({ stdin: { contents: text, resolveDir: join(HERE, "../src"), loader: "ts" }, write: false, platform: "neutral" });
const { load, Pose, Poser } = await import(`data:text/javascript;base64,${Buffer.from(outputFiles[0].contents).toString("base64")}`);

const HEAD = join(HERE, "../build/bench/avatars/head.avatar");
if (!existsSync(HEAD)) {
  console.error("pose_speed.mjs: there is no sample head; run `npm run bench` first, which makes it");
  process.exit(2);
}
const head = await load(new Uint8Array(await readFile(HEAD)));
show("sample head", head, 0.2);
show("262 joints", withJoints(head, 262), 0.5);

/** The head with its skeleton made longer: a chain behind the last joint. */
function withJoints(avatar, count) {
  const { skeleton, program } = avatar;
  const had = skeleton.names.length;
  const longer = (array, row) => {
    const out = new Float64Array(count * row);
    for (let j = 0; j < count; j++) out.set(array.subarray(Math.min(j, had - 1) * row, (Math.min(j, had - 1) + 1) * row), j * row);
    return out;
  };
  const expressions = avatar.expressions.length;
  const basis = new Float64Array(expressions * count * 3);
  for (let k = 0; k < expressions; k++) basis.set(skeleton.jointBasis.subarray(3 * k * had, 3 * (k + 1) * had), 3 * k * count);
  const made = {
    ...skeleton,
    names: Array.from({ length: count }, (_, j) => skeleton.names[j] ?? `joint_${j}`),
    parents: Int32Array.from({ length: count }, (_, j) => (j < had ? skeleton.parents[j] : j - 1)),
    restLocal: longer(skeleton.restLocal, 16),
    inverseBindMatrix: longer(skeleton.inverseBindMatrix, 16),
    jointBasis: basis,
  };
  return { ...avatar, skeleton: made, program: { ...program, poseFloats: program.poseFloats + 12 * (count - had) } };
}

function show(name, avatar, limit) {
  const [pose, poser] = [new Pose(avatar), new Poser(avatar)];
  const times = [];
  for (let round = 0; round < ROUNDS; round++) {
    const begin = performance.now();
    for (let i = 0; i < TURNS; i++) {
      for (let k = 0; k < pose.expressionWeights.length; k++) pose.expressionWeights[k] = 0.1 + 1e-5 * i;
      for (let j = 0; j < avatar.skeleton.names.length; j++) pose.setJoint(avatar.skeleton.names[j], 1e-5 * i, 0.01, 0);
      poser.update(pose);
    }
    times.push((performance.now() - begin) / TURNS);
  }
  const median = times.sort((a, b) => a - b)[ROUNDS >> 1];
  const { names, anchorVertices } = avatar.skeleton;
  const what = `${names.length} joints, ${avatar.expressions.length} expressions, ${anchorVertices.length} anchor vertices`;
  console.log(`${name} (${what}): ${median.toFixed(4)} ms a pose, limit ${limit} ms`);
  if (median > limit) process.exitCode = 1;
}
