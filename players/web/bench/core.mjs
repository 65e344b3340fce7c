// CPU time of what the core does: `node bench/core.mjs PACK.avatar...`. Prints a table of the best of five runs.

import { buildSync } from "esbuild";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { basename, dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const RUNS = 5;
const POSES = 2000;
const core = await bundled();

async function bundled() {
  const outfile = join(mkdtempSync(join(tmpdir(), "avatar-bench-")), "core.mjs");
  const entry = join(dirname(fileURLToPath(import.meta.url)), "..", "src", "index.ts");
  buildSync({ entryPoints: [entry], bundle: true, format: "esm", target: "es2022", outfile });
  const found = await import(pathToFileURL(outfile).href);
  rmSync(dirname(outfile), { recursive: true });
  return found;
}

/** The least CPU time of one call, milliseconds. */
async function best(run, calls) {
  let least = Infinity;
  for (let i = 0; i < RUNS; i++) {
    const begun = process.cpuUsage();
    for (let call = 0; call < calls; call++) await run(call);
    const { user, system } = process.cpuUsage(begun);
    least = Math.min(least, (user + system) / 1000 / calls);
  }
  return least;
}

/** The same without waiting, for calls of microseconds. */
function quick(run) {
  return best(() => {
    for (let call = 0; call < POSES; call++) run(call);
  }, 1).then((milliseconds) => milliseconds / POSES);
}

function print(what, milliseconds) {
  console.log(`${what.padEnd(64)} ${milliseconds.toFixed(4)} ms`);
}

/** An avatar of `joints` joints in a tree and 52 expressions that move all of them. */
function skeletal(joints) {
  const names = Array.from({ length: joints }, (_, j) => `joint${j}`);
  const restLocal = new Float64Array(16 * joints);
  for (let at = 0; at < restLocal.length; at += 16) restLocal.set([1, 0, 0, 0.01, 0, 1, 0, 0.02, 0, 0, 1, 0, 0, 0, 0, 1], at);
  const expressions = Array.from({ length: 52 }, (_, k) => ({ name: `e${k}`, aliases: [], range: [0, 1] }));
  const skeleton = {
    names,
    parents: Int32Array.from(names, (_, j) => Math.floor((j - 1) / 2)),
    restLocal,
    inverseBindMatrix: restLocal,
    jointBasis: new Float64Array(3 * joints * expressions.length).fill(0.001),
    correctiveJoints: new Uint32Array(0),
    anchorVertices: new Uint32Array(0),
  };
  const pose = { weights: 0, features: 52, late: 52, joints: 52 };
  return { expressions, lateMorphs: [], skeleton, groups: [], rules: {}, program: { pose, poseFloats: 52 + 12 * joints } };
}

function bent(avatar) {
  const pose = new core.Pose(avatar);
  pose.expressionWeights.fill(0.3);
  for (const name of avatar.skeleton?.names ?? []) pose.setJoint(name, 0.1, 0.2, 0.3);
  return pose;
}

for (const path of process.argv.slice(2)) {
  const bytes = new Uint8Array(readFileSync(path));
  const avatar = await core.load(bytes);
  const held = [...avatar.program.buffers.values()].reduce((sum, one) => sum + (one.sections.length > 0 ? one.bytes : 0), 0);
  const name = basename(path);
  console.log(`${name}: ${avatar.levels[0].count} Gaussians, ${bytes.length} bytes, ${held} in buffers`);
  print(`  load`, await best(() => core.load(bytes), 3));
  const pose = bent(avatar);
  const poser = new core.Poser(avatar);
  const joints = avatar.skeleton?.names.length ?? 0;
  print(`  joints, ${joints} joints, ${avatar.expressions.length} expressions`, await quick(() => poser.update(pose)));
  if (avatar.driving !== null) {
    const driver = new core.Driver(avatar);
    const frame = core.drivingFrame();
    frame.weights.fill(0.3);
    frame.head.fill(0.1);
    print(`  driving`, await quick(() => driver.pose(frame, pose)));
  }
  if (avatar.clips.length > 0) {
    const clip = new core.Clip(avatar, 0);
    print(`  a clip between two frames`, await quick((i) => clip.sample((clip.seconds * i) / POSES, pose)));
  }
}
const large = skeletal(262);
const pose = bent(large);
const poser = new core.Poser(large);
print("262 joints, 52 expressions that move all of them: joints", await quick(() => poser.update(pose)));
