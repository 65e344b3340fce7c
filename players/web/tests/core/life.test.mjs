// Idle life: the vectors of all players, and what people would notice in an hour of it. A gaze that follows; fades.

import assert from "node:assert/strict";
import { test } from "node:test";
import { core, json, loaded, near } from "./harness.mjs";

const DEGREES = 180 / Math.PI;
const RATE = 60; // frames a second
const at = (name) => core.ARKIT_NAMES.indexOf(name);
const LIDS = at("eyeBlinkLeft");
const EYES = new Set(core.ARKIT_NAMES.flatMap((name, c) => (/^eye(Blink|Look)/.test(name) ? [c] : []))); // they jump
const channelsOf = (frame) => [...frame.weights, ...frame.head, ...frame.leftEye, ...frame.rightEye];

/** Where the eyes look, degrees to the left and up of the resting head. */
const gazeOf = ({ head, leftEye }) => [0, 1].map((axis) => DEGREES * (head[axis] - leftEye[axis]));

test("idle life has the numbers of every player", () => {
  const frame = core.drivingFrame();
  for (const { seconds, seed, channels } of json("idle.json")) {
    core.idle(seconds, seed, frame);
    near(channelsOf(frame), core.CHANNELS.map((name) => channels[name] ?? 0), 1e-7, `seed ${seed}, ${seconds} s: channels`);
  }
});

test("an hour of it looks like a person", () => {
  const [frame, frames] = [core.drivingFrame(), 3600 * RATE];
  const [before, mean] = [new Float64Array(61), new Float64Array(61)];
  const [blinks, most] = [[], { weight: 0, head: 0, gaze: 0 }];
  let [viewer, shifts, last] = [0, 0, [0, 0]];
  for (let i = 0; i < frames; i++) {
    core.idle(i / RATE, 7, frame);
    for (let c = 0; c < 55; c++) {
      const value = c < 52 ? frame.weights[c] : frame.head[c - 52];
      mean[c] += value / frames;
      if (i > 0 && !EYES.has(c)) most[c < 52 ? "weight" : "head"] = Math.max(most[c < 52 ? "weight" : "head"], Math.abs(value - before[c]));
      if (c === LIDS && value > 0) {
        if (before[c] === 0) blinks.push({ begin: i, most: 0 });
        const blink = blinks.at(-1);
        blink.end = i;
        blink.most = Math.max(blink.most, value);
      }
      before[c] = value;
    }
    const gaze = gazeOf(frame), far = Math.hypot(...gaze);
    most.gaze = Math.max(most.gaze, far);
    if (far < 1.7) viewer += 1 / frames;
    if (Math.hypot(gaze[0] - last[0], gaze[1] - last[1]) > 0.5) shifts++;
    last = gaze;
  }
  const whole = blinks.slice(1, -1);
  assert.ok(whole.every((one) => one.most > 0.999 && one.most < 1.001), "every blink closes the lids");
  const lasts = whole.map(({ begin, end }) => (end - begin + 1) / RATE);
  assert.ok(Math.min(...lasts) > 0.26 && Math.max(...lasts) < 0.36, `a blink lasts ${Math.min(...lasts)} to ${Math.max(...lasts)} s`);
  const isSecond = (i) => i > 0 && whole[i].begin - whole[i - 1].begin < 0.5 * RATE;
  const begins = whole.filter((_, i) => !isSecond(i)).map(({ begin }) => begin / RATE);
  const apart = begins.slice(1).map((begin, i) => begin - begins[i]);
  assert.ok(Math.min(...apart) > 1.95 && Math.max(...apart) < 7.05, `blinks are ${Math.min(...apart)} to ${Math.max(...apart)} s apart`);
  const pairs = 1 - begins.length / whole.length;
  assert.ok(pairs > 0.07 && pairs < 0.15, `${pairs} are seconds of pairs`);
  assert.ok(most.gaze > 6 && most.gaze < 9, `a glance goes ${most.gaze} degrees away`);
  assert.ok(viewer > 0.6 && viewer < 0.75, `${viewer} of the time is for the viewer`);
  assert.ok(shifts > 2000 && shifts < 8000, `${shifts} frames see a saccade`);
  assert.ok(DEGREES * most.head < 0.2, `the head jumps by ${DEGREES * most.head} degrees`);
  assert.ok(most.weight < 0.005, `a weight jumps by ${most.weight}`);
  mean.forEach((value, c) => assert.ok(c < 52 ? value <= 0.1 : Math.abs(value) < 0.008, `${core.CHANNELS[c]} is ${value} on the mean`));
});

test("nothing repeats in an hour, and seeds differ", () => {
  const frame = core.drivingFrame();
  const yaws = (seed) => Float64Array.from({ length: 3600 }, (_, t) => (core.idle(t, seed, frame), frame.head[0]));
  const [one, other] = [yaws(1), yaws(2)];
  const size = Math.hypot(...one) * Math.hypot(...other);
  const like = (a, b, lag) => a.reduce((sum, value, i) => sum + value * (b[i + lag] ?? 0), 0) / size;
  for (let lag = 10; lag < 1800; lag++) assert.ok(Math.abs(like(one, one, lag)) < 0.3, `it is like itself ${lag} s later`);
  for (let lag = 0; lag < 60; lag++) assert.ok(Math.abs(like(one, other, lag)) < 0.3, `seeds are alike, ${lag} s apart`);
});

test("eyes and head follow a target, and long steps do what short ones do", () => {
  const [frame, short, long] = [core.drivingFrame(), new core.Look(), new core.Look()];
  for (const look of [short, long]) look.at(0.3, -0.15);
  for (let i = 0; i < 25; i++) short.step(0.01);
  long.step(0.25);
  const frames = [short, long].map((look) => {
    const made = core.drivingFrame();
    look.add(made);
    return channelsOf(made);
  });
  near(frames[0], frames[1], 1e-6, "after a quarter of a second");
  assert.ok(frames[1][52] > 0.01 && frames[1][52] < 0.09, "the head has begun");
  let steps = 0;
  while (long.step(0.1)) assert.ok(++steps < 100, "it comes to rest");
  long.add(frame);
  near(gazeOf(frame), [0.3 * DEGREES, -0.15 * DEGREES], 0.02, "gaze");
  assert.ok(frame.head[0] > 0.1 && frame.head[1] < -0.05, "the head turns to the left and down, too");
  assert.ok(frame.weights[at("eyeLookOutLeft")] > 0 && frame.weights[at("eyeLookDownRight")] > 0);
  near(frame.leftEye, frame.rightEye, 0, "parallel eyes");
  long.at(NaN, 9);
  long.step(60);
  frame.head.fill(0);
  long.add(frame);
  assert.ok(gazeOf(frame)[1] < 29 && Math.abs(gazeOf(frame)[0]) < 0.01, "what no neck reaches is cut");
  long.release();
  long.step(60);
  const rest = core.drivingFrame();
  long.add(rest);
  assert.deepEqual(channelsOf(rest), new Array(61).fill(0));
});

test("life is added to a pose, within the trained ranges, and fades in and out", async () => {
  const avatar = await loaded("joints");
  const [life, pose, out, driven] = [new core.Life(avatar, 4), new core.Pose(avatar), new core.Pose(avatar), new core.Pose(avatar)];
  pose.setExpression("jaw_open", 0.4);
  pose.setJoint("jaw", 0.1, 0.2, 0.3);
  assert.equal(life.pose(5, pose, out), false);
  assert.deepEqual(out, pose, "without life it is the pose");
  life.idle = true;
  for (let t = 5; t < 7; t += 0.1) assert.equal(life.pose(t, pose, out), true);
  const frame = core.drivingFrame();
  core.idle(7, 4, frame);
  new core.Driver(avatar).pose(frame, driven);
  let cut = 0;
  for (const beyond of [0, -0.2, 0.2]) {
    avatar.expressions.forEach(({ range }, i) => { pose.expressionWeights[i] = beyond + range[beyond < 0 ? 0 : 1]; });
    life.pose(7, pose, out);
    avatar.expressions.forEach(({ range: [low, high] }, i) => {
      const [own, more] = [pose.expressionWeights[i], driven.expressionWeights[i]];
      const want = Math.min(Math.max(own + more, Math.min(own, low)), Math.max(own, high));
      near([out.expressionWeights[i]], [want], 1e-6, `${avatar.expressions[i].name} at ${own}`);
      if (Math.abs(want - own - more) > 1e-3) cut++;
    });
  }
  assert.ok(cut > 0, "a range was reached");
  assert.notDeepEqual(out.jointDelta, pose.jointDelta);
  life.idle = false;
  let frames = 0;
  while (life.pose(7 + ++frames / 60, pose, out)) assert.ok(frames < 60);
  assert.ok(frames >= 29 && frames <= 31, `it fades out in ${frames} frames of 60 a second`);
  near(out.jointDelta, pose.jointDelta, 1e-12, "joints are back");
});

test("a pose that comes from elsewhere fades in, and an avatar without driving keeps still", async () => {
  const avatar = await loaded("surface_without_rig");
  const still = new core.Life(avatar);
  still.idle = true;
  const [rest, out] = [new core.Pose(avatar), new core.Pose(avatar)];
  for (const seconds of [0, 0.1, 9]) assert.equal(still.pose(seconds, rest, out), false, "no frame is asked for");
  assert.deepEqual(out, rest);
  const rigged = await loaded("joints");
  const [life, from, to, shown] = [new core.Life(rigged), new core.Pose(rigged), new core.Pose(rigged), new core.Pose(rigged)];
  from.setExpression("jaw_open", 1);
  from.setJoint("jaw", 0.4, 0, 0);
  life.pose(0, from, shown);
  life.crossfade();
  assert.equal(life.pose(9, to, shown), true); // the first frame after rest
  assert.equal(life.pose(9 + 0.25 - 1 / 60, to, shown), true);
  near([shown.expressionWeights[0]], [0.5], 1e-6, "half of the way");
  const turned = new Float64Array(3);
  shown.readJoint("jaw", turned);
  near(turned, [0.2, 0, 0], 1e-6, "half of the way");
  assert.equal(life.pose(9.4, to, shown), true);
  assert.equal(life.pose(9.6, to, shown), true);
  assert.equal(life.pose(9.7, to, shown), false);
  assert.deepEqual(shown, to);
});
