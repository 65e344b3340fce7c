// Live Link Face CSV as Python reads it, and what is wrong in one.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bytes, core, near, ROUNDING, tensors } from "./harness.mjs";

const text = () => new TextDecoder().decode(bytes("recording.csv"));

test("a real recording has Python's times and channels", () => {
  const recording = core.parseLiveLinkCsv(text());
  const want = tensors("recording.safetensors");
  assert.deepEqual([...recording.times], [...want.times.values]);
  assert.deepEqual([...recording.channels], [...want.channels.values]);
  assert.equal(recording.fps, want.fps.values[0]);
  assert.equal(recording.frames, 300);
  assert.deepEqual(recording.missing, []);
});

test("a recording is exact at its frames, linear between them, and holds at the ends", () => {
  const recording = core.parseLiveLinkCsv(text());
  const [frame, want, count] = [core.drivingFrame(), core.drivingFrame(), core.CHANNELS.length];
  const { times, channels } = recording;
  for (const [seconds, index] of [...[0, 1, 2, 299, 150, 0].map((i) => [times[i], i]), [-5, 0], [1e6, 299], [NaN, 0]]) {
    recording.sample(seconds, frame);
    core.setChannels(want, channels, count * index);
    assert.deepEqual(frame, want);
  }
  recording.sample((times[1] + times[2]) / 2, frame);
  core.setChannels(want, channels.slice(count, 2 * count).map((value, c) => (value + channels[2 * count + c]) / 2));
  near(frame.weights, want.weights, 4 * ROUNDING, "weights");
  near(frame.head, want.head, 1e-12, "head");
});

const HEAD = "Timecode,BlendShapeCount,JawOpen,bs_node.eyeBlink_L,headYaw,note";

test("quotes, other spellings, midnight and rows without a face are understood", () => {
  const rows = [
    '\uFEFFTimecode,BlendShapeCount,"JawOpen",eyeBlink_L,headYaw,"a ""note"""',
    "23:59:59:58.5,61,0.25,0.5,0.1,x",
    '23:59:59:59,0,0,0,0,"no\r\nface"',
    "",
    "00:00:00:00.000,61, 1e-1 ,-.5,+2.,",
  ];
  const recording = core.parseLiveLinkCsv(rows.join("\r\n"));
  near(recording.times, [0, 1.5 / 60], 1e-9, "times");
  assert.equal(recording.withoutFace, 1);
  assert.equal(recording.missing.length, 58);
  const at = (name) => [0, 61].map((row) => recording.channels[row + core.CHANNELS.indexOf(name)]);
  assert.deepEqual([at("jawOpen"), at("eyeBlinkLeft"), at("headYaw")], [[0.25, 0.1], [0.5, -0.5], [0.1, 2]]);
});

test("the rate is the smallest above the highest frame, and 60 within one second", () => {
  const times = (...codes) => [...core.parseLiveLinkCsv(["Timecode,jawOpen", ...codes.map((code) => `${code},0`)].join("\n")).times];
  near(times("10:00:00:01", "10:00:00:03"), [0, 2 / 60], 1e-9, "one second");
  near(times("10:00:00:01", "10:00:01:03"), [0, 1 + 2 / 24], 1e-9, "two seconds");
  near(times("10:00:00:01", "10:00:01:24"), [0, 1 + 23 / 25], 1e-9, "frame 24");
});

test("what is wrong is named with its line", () => {
  const row = "10:00:00:01,61,0,0,0,x";
  for (const [rows, message] of [
    [[""], /a\.csv: line 1: has no Timecode column/],
    [["a,b"], /a\.csv: line 1: has no Timecode column; a Live Link Face CSV is needed/],
    [["Timecode,jawopn"], /line 1: 'Timecode, jawopn' is not an ARKit column/],
    [["Timecode,jawOpen,JAW_OPEN"], /line 1: columns 2 and 3 are both jawOpen/],
    [[HEAD], /has no frame with a face/],
    [[HEAD, row, "10:00:00:02,61,0,0"], /line 3 has 4 fields, but the header has 6/],
    [[HEAD, row, "10:00:00:02,61,zero,0,0,x"], /JawOpen: line 3: 'zero' is not a weight or an angle/],
    [[HEAD, row, "10:00:00:02,61,,0,0,x"], /JawOpen: line 3: '' is not/],
    [[HEAD, row, "10:00:00:02,61,0,0,1000,x"], /headYaw: line 3: '1000' is not/],
    [[HEAD, row, "10:00:00:02,61,0,0,NaN,x"], /headYaw: line 3: 'NaN' is not/],
    [[HEAD, row, "10:00:00,61,0,0,0,x"], /Timecode: line 3: '10:00:00' is not a timecode/],
    [[HEAD, row, "25:00:00:00,61,0,0,0,x"], /Timecode: line 3: '25:00:00:00' is not a time of day/],
    [[HEAD, row, "", '09:59:59:01,61,0,0,0,"x"'], /Timecode: line 4 is earlier than the one before/],
    [[HEAD, '10:00:00:01,61,0,0,0,"x'], /line 2: a quotation mark is not closed/],
    [[HEAD, '10:00:00:01,61,0,0,0,"x"y'], /line 2: a comma is missing behind a quotation mark/],
  ]) {
    assert.throws(() => core.parseLiveLinkCsv(rows.join("\n"), "a.csv"), { name: "AvatarError", message });
  }
});
