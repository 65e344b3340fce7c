// Stage joints, driving, clips and names, judged by Python's numbers.

import assert from "node:assert/strict";
import { test } from "node:test";
import { core, json, largest, loaded, near, PACKS, ROUNDING, row, tensors } from "./harness.mjs";

// Python rounds skin matrices to float32 before it skins anchors and mixes joints; here everything is float64.
const ROUNDINGS = 16;

for (const name of PACKS) {
  test(`${name}: poses give what Python computes`, async () => {
    const avatar = await loaded(name);
    const poser = new core.Poser(avatar);
    const pose = new core.Pose(avatar);
    const want = tensors(name, "poses.safetensors");
    for (let index = 0; index < want.pose_floats.shape[0]; index++) {
      pose.expressionWeights.set(row(want.expression_weights, index));
      pose.lateWeights.set(row(want.late_weights, index));
      pose.jointDelta.set(row(want.joint_delta, index));
      pose.worldFromAvatar.set(row(want.world_from_avatar, index));
      const posed = poser.update(pose);
      for (const [array, key] of [["poseFloats", "pose_floats"], ["groupMatrix", "group_matrix"], ["groupRotation", "group_rotation"]]) {
        const expected = row(want[key], index);
        near(posed[array], expected, ROUNDINGS * ROUNDING * largest(expected), `pose ${index} ${array}`);
      }
      assert.deepEqual([...posed.worldFromAvatar], [...row(want.world_from_avatar, index)]);
    }
  });
}

for (const name of PACKS.filter((one) => one !== "surface_without_rig")) {
  test(`${name}: driving and joints repeat the reference`, async () => {
    const avatar = await loaded(name);
    const { cases, channels } = json(name, "driving.json");
    const held = tensors(name, "driving.safetensors");
    assert.deepEqual(channels, core.CHANNELS);
    for (const one of cases) {
      for (const stage of one.stages) {
        const given = Object.fromEntries(Object.entries(stage.inputs).map(([key, { tensor }]) => [key, held[tensor].values]));
        const got = stage.stage === "driving" ? driven(avatar, one, given) : joined(avatar, given);
        for (const [key, { tensor, atol, rtol }] of Object.entries(stage.outputs)) {
          const expected = held[tensor].values;
          near(got[key], expected, atol + rtol * largest(expected), `${one.name} ${stage.stage} ${key}`);
        }
      }
    }
  });
}

function driven(avatar, one, { channels }) {
  const frame = core.drivingFrame();
  const pose = new core.Pose(avatar);
  core.setChannels(frame, channels);
  new core.Driver(avatar, { withinRange: one.within_range }).pose(frame, pose);
  return {
    expression_weights: pose.expressionWeights,
    late_weights: pose.lateWeights,
    joint_delta: pose.jointDelta,
    world_from_avatar: pose.worldFromAvatar,
  };
}

function joined(avatar, given) {
  const pose = new core.Pose(avatar);
  pose.expressionWeights.set(given.expression_weights);
  pose.jointDelta.set(given.joint_delta);
  const posed = new core.Poser(avatar).update(pose, given.anchor_vertices ?? null);
  const { features, late, joints } = avatar.program.pose;
  const skin = [];
  for (let at = joints; at < posed.poseFloats.length; at += 12) {
    skin.push(...posed.poseFloats.subarray(at, at + 12), 0, 0, 0, 1);
  }
  return {
    skin_matrix: skin,
    pose_feature: posed.poseFloats.subarray(features, late),
    group_matrix: posed.groupMatrix,
    group_rotation: posed.groupRotation.filter((_, i) => i % 4 < 3),
  };
}

test("a driven pose leaves nothing of the one before", async () => {
  const avatar = await loaded("joints");
  const frame = core.drivingFrame();
  const pose = new core.Pose(avatar);
  const fresh = new core.Pose(avatar);
  const driver = new core.Driver(avatar);
  pose.expressionWeights.fill(3);
  pose.lateWeights.fill(3);
  pose.jointDelta.fill(3);
  pose.worldFromAvatar.fill(3);
  driver.pose(frame, pose);
  driver.pose(frame, fresh);
  assert.deepEqual(pose, fresh);
});

test("an avatar without a mapping cannot be driven", async () => {
  const avatar = await loaded("surface_without_rig");
  assert.throws(() => new core.Driver(avatar), { name: "AvatarError", field: "driving" });
});

test("a joint that is flat cannot turn", async () => {
  const avatar = await loaded("joints");
  const restLocal = avatar.skeleton.restLocal.slice();
  for (const at of [16, 20, 24]) restLocal[at] *= 1e-7;
  const flat = { ...avatar, skeleton: { ...avatar.skeleton, restLocal } };
  assert.throws(() => new core.Driver(flat), { name: "AvatarError", field: "joint neck" });
});

test("a joint that is turned by name turns alike in packs of both handednesses", async () => {
  const [right, left] = await Promise.all(["joints", "left"].map(async (name) => new core.Pose(await loaded(name))));
  const turn = [0.3, -0.7, 0.5];
  for (const pose of [right, left]) pose.setJoint("jaw", ...turn);
  const mirrored = right.jointDelta.map((value, i) => (i % 16 < 4 !== (i % 4 === 0) ? -value : value)); // S M S
  near(left.jointDelta, mirrored, 1e-15, "jaw");
  for (const pose of [right, left]) {
    const found = new Float64Array(3);
    pose.readJoint("jaw", found);
    near(found, turn, 1e-14, "read");
  }
});

test("names and aliases set weights, and unknown names list near ones", async () => {
  const avatar = await loaded("joints");
  const pose = new core.Pose(avatar);
  pose.setExpression("jaw_open", 0.5);
  pose.setExpression("exp_003", -1);
  pose.setEyelid("right", 0.25);
  pose.setJoint("jaw", Math.PI / 2, 0, 0);
  assert.deepEqual([...pose.expressionWeights], [0.5, 0, 0, -1]);
  assert.deepEqual([...pose.lateWeights], [0, 0.25]);
  near(pose.jointDelta.subarray(32, 48), [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1], 1e-15, "jaw");
  assert.throws(() => pose.setExpression("jawOpn", 1), { name: "AvatarError", message: /'jawOpn' is not an expression of this avatar; did you mean jawOpen/ });
  assert.throws(() => pose.setJoint("zzz", 0, 0, 0), { name: "AvatarError", message: /'zzz' is not a joint of this avatar; there are 5: root, neck/ });
  assert.throws(() => pose.setEyelid("constructor", 0), { name: "AvatarError" });
  assert.throws(() => pose.setExpression("jawOpen", NaN), { name: "AvatarError", field: "expression jawOpen" });
  assert.throws(() => pose.setJoint("jaw", Infinity, 0, 0), { name: "AvatarError", field: "joint jaw" });
  const other = new core.Pose(avatar);
  other.copy(pose);
  assert.deepEqual(other, pose);
  pose.reset();
  assert.deepEqual(pose, new core.Pose(avatar));
});

test("clips are exact at frames and hold at the ends", async () => {
  for (const name of ["joints", "joints_exact", "left"]) {
    const avatar = await loaded(name);
    const pose = new core.Pose(avatar);
    avatar.clips.forEach((data, index) => {
      const clip = new core.Clip(avatar, index);
      assert.equal(clip.seconds, (data.frames - 1) / data.fps);
      for (let frame = -2; frame < data.frames + 2; frame++) {
        const held = Math.min(Math.max(frame, 0), data.frames - 1);
        clip.sample(frame / clip.fps, pose);
        for (const array of ["expressionWeights", "lateWeights", "jointDelta", "worldFromAvatar"]) {
          const size = pose[array].length;
          assert.deepEqual([...pose[array]], [...data[array].subarray(held * size, (held + 1) * size)], `${name} ${array} ${frame}`);
        }
      }
    });
  }
  assert.throws(() => new core.Clip({ name: "a", clips: [] }, 0), { name: "AvatarError", field: "clips" });
});

/** An avatar of one joint with a clip of two frames whose joint has these matrices. */
function twoFrames(first, second) {
  const still = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  const clip = {
    name: "turn",
    fps: 10,
    frames: 2,
    expressionWeights: Float32Array.of(0, 1),
    lateWeights: new Float32Array(0),
    jointDelta: Float32Array.from([...first, ...second]),
    worldFromAvatar: Float32Array.from([...still, ...still]),
  };
  return { expressions: [{ name: "a", aliases: [], range: [0, 1] }], lateMorphs: [], skeleton: { names: ["j"] }, clips: [clip] };
}

/** A rotation about a unit axis, times a scale of each column, with a translation. */
function transform(axis, angle, scale, translation) {
  const m = new Float64Array(16);
  core.setRotation(m, 0, Float64Array.from(axis, (one) => one * angle), 0);
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 3; j++) m[4 * i + j] *= scale[j];
    m[4 * i + 3] = translation[i];
  }
  m[15] = 1;
  return m;
}

test("between frames rotations turn, scales and translations are linear", () => {
  const axis = [2 / 7, 3 / 7, 6 / 7];
  for (const angle of [0.2, 1.5, 3.1]) {
    for (const start of [0, 2.9]) {
      const avatar = twoFrames(transform(axis, start, [1, 2, 3], [0, 1, 2]), transform(axis, start + angle, [2, 2, -1], [4, 1, 0]));
      const pose = new core.Pose(avatar);
      new core.Clip(avatar, 0).sample(0.05, pose);
      const half = transform(axis, start + angle / 2, [1.5, 2, 1], [2, 1, 1]);
      near(pose.jointDelta, half, 64 * ROUNDING, `angle ${angle} from ${start}`);
      assert.equal(pose.expressionWeights[0], 0.5);
    }
  }
});

test("a frame of a pose makes no garbage", async () => {
  const avatar = await loaded("joints");
  const poser = new core.Poser(avatar);
  const pose = new core.Pose(avatar);
  const driver = new core.Driver(avatar);
  const clip = new core.Clip(avatar, 0);
  const camera = new core.Camera();
  const frame = core.drivingFrame();
  const target = [0, 0, 0];
  frame.weights.fill(0.5);
  const play = (times) => {
    for (let i = 0; i < times; i++) {
      driver.pose(frame, pose);
      clip.sample(i / 3001, pose);
      poser.update(pose);
      camera.orbit(target, 1, 0.1, 0.2, 0.5, 64, 64);
    }
  };
  play(20000); // until everything is compiled
  const times = 2000;
  let least = Infinity; // of several rounds: others in this process allocate too
  for (let round = 0; round < 5; round++) {
    const before = process.memoryUsage().heapUsed;
    play(times);
    const grown = process.memoryUsage().heapUsed - before;
    least = grown >= 0 ? Math.min(least, grown) : least; // less than 0: memory was collected
  }
  // V8 boxes some fractions, 16 bytes each; a typed array in every call would be 700 bytes and more.
  assert.ok(least < 256 * times, `${least / times} bytes a frame`);
});
