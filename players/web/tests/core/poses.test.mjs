// Stage joints, driving, clips and names, judged by Python's numbers.

import assert from "node:assert/strict";
import { test } from "node:test";
import { core, json, largest, loaded, near, PACKS, ROUNDING, row, tensors } from "./harness.mjs";

// Python rounds skin matrices to float32 before it skins anchors and mixes joints; here everything is float64.
const ROUNDINGS = 16;
const ARRAYS = ["expressionWeights", "lateWeights", "jointDelta", "worldFromAvatar"];

const snake = (name) => name.replace(/[A-Z]/g, (letter) => `_${letter.toLowerCase()}`);

for (const name of PACKS) {
  test(`${name}: poses give what Python computes`, async () => {
    const avatar = await loaded(name);
    const poser = new core.Poser(avatar);
    const pose = new core.Pose(avatar);
    const want = tensors(name, "poses.safetensors");
    for (let index = 0; index < want.pose_floats.shape[0]; index++) {
      for (const array of ARRAYS) pose[array].set(row(want[snake(array)], index));
      const posed = poser.update(pose);
      for (const array of ["poseFloats", "groupMatrix", "groupRotation"]) {
        const expected = row(want[snake(array)], index);
        near(posed[array], expected, ROUNDINGS * ROUNDING * largest(expected), `pose ${index} ${array}`);
      }
      assert.deepEqual([...posed.worldFromAvatar], [...row(want.world_from_avatar, index)]);
    }
  });
}

for (const name of PACKS.filter((one) => one !== "surface_without_rig")) {
  test(`${name}: driving repeats the reference`, async () => {
    const avatar = await loaded(name);
    const { cases, channels } = json(name, "driving.json");
    const held = tensors(name, "driving.safetensors");
    const [frame, pose] = [core.drivingFrame(), new core.Pose(avatar)];
    assert.deepEqual(channels, core.CHANNELS);
    const driven = cases.flatMap((one) => one.stages.map((stage) => ({ ...one, ...stage }))).filter(({ stage }) => stage === "driving");
    assert.ok(driven.length > 0);
    for (const { name: what, within_range: withinRange, inputs, outputs } of driven) {
      core.setChannels(frame, held[inputs.channels.tensor].values);
      new core.Driver(avatar, { withinRange }).pose(frame, pose);
      for (const array of ARRAYS) {
        const { tensor, atol, rtol } = outputs[snake(array)];
        const expected = held[tensor].values;
        near(pose[array], expected, atol + rtol * largest(expected), `${what} ${array}`);
      }
    }
  });
}

test("a driven pose leaves nothing of the one before", async () => {
  const avatar = await loaded("joints");
  const [pose, fresh, driver] = [new core.Pose(avatar), new core.Pose(avatar), new core.Driver(avatar)];
  for (const array of ARRAYS) pose[array].fill(3);
  driver.pose(core.drivingFrame(), pose);
  driver.pose(core.drivingFrame(), fresh);
  assert.deepEqual(pose, fresh);
});

test("an avatar without a mapping, and a joint that is flat, cannot be driven", async () => {
  const avatar = await loaded("joints");
  const restLocal = avatar.skeleton.restLocal.map((value, i) => ([16, 20, 24].includes(i) ? 1e-7 * value : value));
  const flat = { ...avatar, skeleton: { ...avatar.skeleton, restLocal } };
  for (const [one, field] of [[await loaded("surface_without_rig"), "driving"], [flat, "joint neck"]]) {
    assert.throws(() => new core.Driver(one), { name: "AvatarError", field });
  }
});

test("a joint that is turned by name turns alike in packs of both handednesses", async () => {
  const [right, left] = await Promise.all(["joints", "left"].map(async (name) => new core.Pose(await loaded(name))));
  const [turn, found] = [[0.3, -0.7, 0.5], new Float64Array(3)];
  for (const pose of [right, left]) {
    pose.setJoint("jaw", ...turn);
    pose.readJoint("jaw", found);
    near(found, turn, 1e-14, "read");
  }
  const mirrored = right.jointDelta.map((value, i) => (i % 16 < 4 !== (i % 4 === 0) ? -value : value)); // S M S
  near(left.jointDelta, mirrored, 1e-15, "jaw");
});

test("names and aliases set weights, and what cannot be set is refused", async () => {
  const avatar = await loaded("joints");
  const [pose, other] = [new core.Pose(avatar), new core.Pose(avatar)];
  assert.deepEqual(avatar.eyelids, ["left", "right"]);
  pose.setExpression("jaw_open", 0.5);
  pose.setExpression("exp_003", -1);
  pose.setEyelid("right", 0.25);
  pose.setJoint("jaw", Math.PI / 2, 0, 0);
  assert.deepEqual([...pose.expressionWeights], [0.5, 0, 0, -1]);
  assert.deepEqual([...pose.lateWeights], [0, 0.25]);
  near(pose.jointDelta.subarray(32, 48), [1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1], 1e-15, "jaw");
  for (const [set, values, message] of [
    ["setExpression", ["jawOpn", 1], /'jawOpn' is not an expression of this avatar; did you mean jawOpen/],
    ["setJoint", ["zzz", 0, 0, 0], /'zzz' is not a joint of this avatar; there are 5: root, neck/],
    ["setEyelid", ["constructor", 0], /'constructor'/],
    ["setExpression", ["jawOpen", NaN], /^expression jawOpen: NaN/],
    ["setJoint", ["jaw", Infinity, 0, 0], /^joint jaw: Infinity/],
  ]) assert.throws(() => pose[set](...values), { name: "AvatarError", message });
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
        clip.pose(frame / clip.fps, pose);
        for (const array of ARRAYS) {
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
  const [jointDelta, worldFromAvatar] = [[first, second], [still, still]].map((two) => Float32Array.from(two.flatMap((one) => [...one])));
  const weights = { expressionWeights: Float32Array.of(0, 1), lateWeights: new Float32Array(0) };
  const clip = { name: "turn", fps: 10, frames: 2, ...weights, jointDelta, worldFromAvatar };
  return { expressions: [{ name: "a", aliases: [], range: [0, 1] }], eyelids: [], skeleton: { names: ["j"] }, clips: [clip] };
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
      new core.Clip(avatar, 0).pose(0.05, pose);
      const half = transform(axis, start + angle / 2, [1.5, 2, 1], [2, 1, 1]);
      near(pose.jointDelta, half, 64 * ROUNDING, `angle ${angle} from ${start}`);
      assert.equal(pose.expressionWeights[0], 0.5);
    }
  }
});
