// CPU time of what the core does, in Node: npm run pose-speed -- [PACK ...]. Without packs, the head of `npm run bench`.
//
// Prints the best of some runs. Exit code 1: a pose of a head takes more than 0.2 ms, or of 262 joints more than 0.5 ms.
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { imported } from "../bundle.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
const RUNS = 5, TURNS = 2000;
const LIMIT_MS = 0.2, LIMIT_LONG_MS = 0.5, LONG = 262; // joints
const core = await imported({ entryPoints: [join(HERE, "../src/index.ts")] });

const packs = process.argv.slice(2);
if (packs.length === 0) packs.push(join(HERE, "../build/bench/avatars/head.avatar"));
for (const path of packs) {
  if (!existsSync(path)) {
    console.error(`pose_speed.mjs: there is no ${path}; name a pack, or run npm run bench first, which makes a head`);
    process.exit(2);
  }
  await measure(path);
}

async function measure(path) {
  const bytes = new Uint8Array(await readFile(path));
  const avatar = await core.load(bytes);
  const [pose, frame] = [new core.Pose(avatar), core.drivingFrame()];
  console.log(`${basename(path)}: ${avatar.levels[0].count} Gaussians, ${bytes.length} bytes`);
  show("load", await best(() => core.load(bytes), 3));
  await showPose(avatar, LIMIT_MS);
  if (avatar.driving !== null) {
    const driver = new core.Driver(avatar);
    frame.weights.fill(0.3);
    show("driving", await best(() => driver.pose(frame, pose), TURNS));
    show("a frame of idle life", await best((i) => core.idle(i / 60, 1, frame), TURNS));
    const life = new core.Life(avatar);
    life.idle = true;
    const rest = new core.Pose(avatar);
    show("idle life, driven and added to a pose", await best((i) => life.pose(i / 60, rest, pose), TURNS));
  }
  if (avatar.clips.length > 0) {
    const clip = new core.Clip(avatar, 0);
    show("a clip between two frames", await best((i) => clip.pose((clip.seconds * i) / TURNS, pose), TURNS));
  }
  if (avatar.skeleton !== null) await showPose(withJoints(avatar, LONG), LIMIT_LONG_MS);
}

/** Names set all weights and joints, and stage `joints` runs. */
async function showPose(avatar, limit) {
  const [pose, poser] = [new core.Pose(avatar), new core.Poser(avatar)];
  const names = avatar.skeleton?.names ?? [];
  const milliseconds = await best((i) => {
    pose.expressionWeights.fill(0.1 + 1e-5 * i);
    for (const name of names) pose.setJoint(name, 1e-5 * i, 0.01, 0);
    poser.update(pose);
  }, TURNS);
  show(`a pose, ${names.length} joints, ${avatar.expressions.length} expressions`, milliseconds);
  if (milliseconds > limit) process.exitCode = 1;
}

/** The avatar with a chain of joints behind its last. */
function withJoints(avatar, count) {
  const { skeleton, program, expressions } = avatar;
  const had = skeleton.names.length;
  const longer = (array, row) => Float64Array.from({ length: count * row }, (_, i) => array[i < had * row ? i : (had - 1) * row + (i % row)]);
  const jointBasis = new Float64Array(expressions.length * count * 3);
  expressions.forEach((_, k) => jointBasis.set(skeleton.jointBasis.subarray(3 * k * had, 3 * (k + 1) * had), 3 * k * count));
  const made = {
    ...skeleton,
    names: Array.from({ length: count }, (_, j) => skeleton.names[j] ?? `joint_${j}`),
    parents: Int32Array.from({ length: count }, (_, j) => (j < had ? skeleton.parents[j] : j - 1)),
    restLocal: longer(skeleton.restLocal, 16),
    inverseBindMatrix: longer(skeleton.inverseBindMatrix, 16),
    jointBasis,
  };
  return { ...avatar, skeleton: made, program: { ...program, poseFloats: program.poseFloats + 12 * (count - had) } };
}

/** The least CPU time of a call, milliseconds. */
async function best(run, calls) {
  let least = Infinity;
  for (let i = 0; i < RUNS; i++) {
    const begun = process.cpuUsage();
    for (let call = 0; call < calls; call++) {
      const waiting = run(call);
      if (waiting instanceof Promise) await waiting;
    }
    const { user, system } = process.cpuUsage(begun);
    least = Math.min(least, (user + system) / 1000 / calls);
  }
  return least;
}

function show(what, milliseconds) {
  console.log(`  ${what.padEnd(50)} ${milliseconds.toFixed(4)} ms`);
}
