// How a face is read, without a browser. RECORDING: a Live Link Face CSV. OUT: a folder for what Python reads then.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { imported } from "../../bundle.mjs";

const core = await imported({ entryPoints: [join(dirname(fileURLToPath(import.meta.url)), "internals.ts")] });
const close = (a, b, most, what) => assert.ok(Math.abs(a - b) <= most, `${what}: ${a}, not ${b}`);

test("the filter is the published one", () => {
  // Algorithm 1 of the paper, written down again from its text.
  function published(samples, rates, mincutoff, beta, dcutoff = 1) {
    let xhat, dxhat = 0;
    return samples.map((x, i) => {
      if (i === 0) return (xhat = x);
      const alpha = (cutoff) => 1 / (1 + rates[i] / (2 * Math.PI * cutoff));
      const dx = (x - xhat) * rates[i];
      dxhat = alpha(dcutoff) * dx + (1 - alpha(dcutoff)) * dxhat;
      const a = alpha(mincutoff + beta * Math.abs(dxhat));
      return (xhat = a * x + (1 - a) * xhat);
    });
  }
  const rates = Array.from({ length: 80 }, (_, i) => (i % 3 === 0 ? 15 : 30));
  const samples = rates.map((_, i) => Math.fround(Math.sin(i / 9) + 0.1 * Math.sin(i * 2.7)));
  const filter = new core.OneEuro([{ restHz: 1.5, hzPerSpeed: 2 }]);
  let seconds = 5;
  const found = samples.map((sample, i) => {
    const values = new Float32Array([sample]);
    seconds += i === 0 ? 0 : 1 / rates[i];
    filter.smooth(values, seconds);
    return values[0];
  });
  published(samples, rates, 1.5, 2).forEach((want, i) => close(found[i], want, 1e-6, `sample ${i}`));
});

test("the neutral face is a median over two seconds, without a blink", () => {
  const neutral = new core.Neutral(2);
  const ends = [];
  for (let i = 0; i <= 60; i++) if (neutral.add(Float64Array.of(i % 9 === 0 ? 1 : 0.1, i), i / 30)) ends.push(i);
  assert.deepEqual(ends, [60]);
  close(neutral.values[0], 0.1, 1e-12, "blinking");
  assert.equal(neutral.values[1], 30);
});

const rest = Float64Array.from({ length: 3 * core.LANDMARKS.length }, (_, i) => Math.sin(i * 1.7) + (i % 3 === 2 ? 0.2 : 0));

test("a head that moves leaves nothing of the points, a face that moves does", () => {
  const alignment = new core.Alignment(rest, core.STABLE);
  const away = core.LANDMARKS.length - 1; // no stable point
  const moved = rest.map((value, i) => {
    const [x, y, z] = [0, 1, 2].map((axis) => rest[i - (i % 3) + axis]);
    return 1.1 * value + [0.3 + 0.02 * z - 0.01 * y, -0.2 + 0.01 * x, -0.02 * x][i % 3] + (i === 3 * away + 1 ? 0.05 : 0);
  });
  alignment.fit(moved);
  close(alignment.turn(1), 0.02, 1e-9, "turn about y");
  for (let point = 0; point < core.LANDMARKS.length; point++) {
    for (let axis = 0; axis < 2; axis++) close(alignment.left(moved, point, axis), point === away && axis === 1 ? 0.05 : 0, 1e-9, `point ${point}`);
  }
});

/** What MediaPipe would see of a face: scores by name, turned by yaw (to its left), before a camera 40 cm away. */
function sight(scores = {}, yaw = 0) {
  const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
  const faceLandmarks = Array.from({ length: 478 }, (_, i) => {
    const at = core.LANDMARKS.indexOf(i);
    const [x, y, z] = at < 0 ? [0, 0, 0] : rest.subarray(3 * at, 3 * at + 3);
    return { x: 0.5 + 0.1 * (c * x + s * z), y: 0.5 - 0.1 * y, z: -0.1 * (c * z - s * x) };
  });
  const categories = core.SCORE_NAMES.map((categoryName) => ({ categoryName, score: scores[categoryName] ?? 0.1 }));
  const data = [c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, 0, 0, -40, 1];
  return { faceLandmarks: [faceLandmarks], faceBlendshapes: [{ categories }], facialTransformationMatrixes: [{ data }] };
}
const NONE = { faceLandmarks: [], faceBlendshapes: [], facialTransformationMatrixes: [] };
const AT = (name) => core.CHANNELS.indexOf(name);

function followed(mirror, scores, yaw) {
  const follower = new core.Follower(mirror);
  const channels = new Float32Array(core.CHANNELS.length);
  assert.equal(follower.follow(NONE, 1, 0, channels), "away");
  for (let i = 0; i < 60; i++) assert.equal(follower.follow(sight(), 1, i / 30, channels), "learning");
  follower.follow(sight(), 1, 2, channels);
  for (let i = 61; i < 120; i++) assert.equal(follower.follow(sight(scores, yaw), 1, i / 30, channels), "live");
  return channels;
}

test("a face at rest is zero, and the head turns", () => {
  const still = followed(false, {}, 0);
  assert.ok(still.every((value) => Math.abs(value) < 1e-6), `${still}`);
  close(followed(false, {}, 0.3)[AT("headYaw")], 0.3, 0.05, "yaw");
});

test("a mirror changes sides", () => {
  const look = { eyeLookOutLeft: 0.6 };
  const [own, mirrored] = [followed(false, look, 0.3), followed(true, look, 0.3)];
  assert.ok(own[AT("eyeLookOutLeft")] > 0.5 && own[AT("eyeLookOutRight")] < 0.05);
  for (const [name, other, sign] of [["eyeLookOutLeft", "eyeLookOutRight", 1], ["jawOpen", "jawOpen", 1], ["headYaw", "headYaw", -1], ["headPitch", "headPitch", 1]]) {
    close(mirrored[AT(other)], sign * own[AT(name)], 1e-6, name);
  }
});

test("what is not seen is named, and stays zero", () => {
  assert.deepEqual(core.NOT_SEEN, ["cheekPuff", "tongueOut"]);
  assert.ok(core.SEEN_BADLY.includes("eyeSquintLeft") && !core.SEEN_BADLY.includes("jawOpen"));
  assert.equal(followed(false, { cheekPuff: 0.9 }, 0)[AT("cheekPuff")], 0);
});

test("a recording that is written is read again, here and in Python", () => {
  const recording = core.parseLiveLinkCsv(readFileSync(process.env.RECORDING, "utf8"));
  const frame = core.drivingFrame();
  const recorder = new core.FaceRecorder();
  for (let i = 0; i < recording.frames; i++) {
    recording.sample(recording.times[i], frame);
    recorder.add(frame, 1000 * (40_000 + recording.times[i]));
  }
  const text = core.liveLinkCsv(recorder.recording());
  const again = core.parseLiveLinkCsv(text);
  assert.equal(again.frames, recording.frames);
  recording.times.forEach((time, i) => close(again.times[i], time, 1e-5, `time ${i}`));
  recording.channels.forEach((value, i) => close(again.channels[i], value, 1e-7, `channel ${i}`));
  const two = new core.Recording(Float64Array.of(0, 1.1), new Float64Array(2 * core.CHANNELS.length)); // few frames tell the rate
  close(core.parseLiveLinkCsv(core.liveLinkCsv(two)).times[1], 1.1, 1e-5, "the second of two frames");
  if (process.env.OUT) writeFileSync(join(process.env.OUT, "face.csv"), text);
});

const own = { names: ["JawOpen", "unknown", "eyeBlink_L"], fps: 25, frames: [[0, 9, 0.5], [0.2, 9, 0]] };
const lam = { names: own.names, metadata: { fps: 25 }, frames: own.frames.map((weights, i) => ({ weights, time: i / 25, rotation: [] })) };
const audio2face = { exportFps: 25, facsNames: own.names, numPoses: 3, numFrames: 2, weightMat: own.frames };

test("weights over time as JSON, in three spellings", () => {
  for (const said of [own, lam, audio2face]) {
    const recording = core.parseWeightsJson(`\uFEFF${JSON.stringify(said)}`);
    assert.deepEqual([recording.fps, recording.frames, recording.missing.length], [25, 2, 59]);
    assert.deepEqual([0, 61].map((row) => recording.channels[row + AT("jawOpen")]), [0, 0.2]);
    assert.equal(recording.channels[AT("eyeBlinkLeft")], 0.5);
  }
});

test("what is wrong in a JSON is said in one line", () => {
  const wrong = (change, message) => {
    const said = structuredClone(own);
    change(said);
    assert.throws(() => core.parseWeightsJson(JSON.stringify(said), "a.json"), { name: "AvatarError", message });
  };
  assert.throws(() => core.parseWeightsJson("{", "a.json"), { message: "a.json: is not valid JSON" });
  wrong((said) => delete said.frames, "a.json: frames: is missing or not a list");
  wrong((said) => (said.fps = "25"), 'a.json: fps: is "25", not frames per second');
  wrong((said) => said.frames[1].pop(), "a.json: frames[1]: expected 3 numbers, as many as names");
  wrong((said) => (said.frames[1][0] = 500), "a.json: frames[1]: 500 is not a weight");
  wrong((said) => (said.names[1] = "jawOpen"), "a.json: names: has jawOpen twice");
  wrong((said) => (said.names = ["a", "b", "c"]), /a.json: names: 'a, b, c' is not an ARKit name/);
});
