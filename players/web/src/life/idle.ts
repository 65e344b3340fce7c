// Idle life, number for number as avatar_runtime.driving.idle computes it: no state, nothing that repeats.
import * as made from "../made/idle.js";
import { ARKIT_NAMES, CHANNELS, type DrivingFrame } from "../pose/arkit.js";
import { setGaze } from "./gaze.js";

const DEGREE = Math.PI / 180;
const SHAPES = ARKIT_NAMES.length;
const LIDS = [ARKIT_NAMES.indexOf("eyeBlinkLeft"), ARKIT_NAMES.indexOf("eyeBlinkRight")] as const;

// Streams of random numbers. A row of WANDER has its own, from ROWS on.
const BLINK = 1, PAIR = 2, SHIFT = 3, WHERE = 4, YAW = 5, DRIFT_YAW = 7, BREATH = 9, ROWS = 10;

const TARGETS = new Float64Array(4); // of the newest fixations, on one axis
const GAZE = new Float64Array(2); // in the head: to the subject's left, and up

/**
 * Writes what a person does who only sits there at a time: breathes, blinks, looks about. It depends on the time, which
 * may be any, and the lowest 32 bits of `seed` alone. The eyes look at the viewer, straight ahead of the resting head,
 * most of the time, never more than 9 degrees away.
 */
export function idle(seconds: number, seed: number, frame: DrivingFrame): void {
  frame.weights.fill(0);
  frame.head.fill(0);
  wander(seconds, seed, frame);
  breathe(seconds, seed, frame);
  look(seconds, seed, frame);
  const lids = blink(seconds, seed);
  frame.weights[LIDS[0]] = lids;
  frame.weights[LIDS[1]] = lids;
}

/** Rows of a table, as columns. */
class Rows {
  readonly at: Int32Array; // channel
  readonly row: Int32Array;
  readonly numbers: Float64Array; // [rows, 2]

  constructor(readonly rows: typeof made.WANDER) {
    this.at = Int32Array.from(rows, ([channel]) => CHANNELS.indexOf(channel));
    this.row = Int32Array.from(rows, ([, row]) => row);
    this.numbers = Float64Array.from(rows.flatMap(([, , first, second = 0]) => [first as number, second]));
  }
}

const WANDER = new Rows(made.WANDER);
const BREATH_ROWS = new Rows(made.BREATH);

function wander(seconds: number, seed: number, frame: DrivingFrame): void {
  const { at, row, numbers } = WANDER;
  for (let i = 0; i < at.length; i++) {
    const value = curve(seconds / (numbers[2 * i] as number), seed, ROWS + (row[i] as number));
    add(frame, at[i] as number, numbers[2 * i + 1] as number, value, 1 + value);
  }
}

function breathe(seconds: number, seed: number, frame: DrivingFrame): void {
  const { at, numbers } = BREATH_ROWS;
  const [part, knotS] = made.BREATH_DRIFT as [number, number];
  const breaths = seconds / made.BREATH_EVERY_S + part * curve(seconds / knotS, seed, BREATH);
  const now = breaths - Math.floor(breaths), sinceIn = now - made.BREATH_IN;
  const full = sinceIn < 0 ? eased(now / made.BREATH_IN) : 1 - eased(sinceIn / made.BREATH_OUT);
  for (let i = 0; i < at.length; i++) add(frame, at[i] as number, numbers[2 * i] as number, full, full);
}

function add(frame: DrivingFrame, at: number, size: number, angle: number, weight: number): void {
  if (at < SHAPES) frame.weights[at] = (frame.weights[at] as number) + size * weight;
  else frame.head[at - SHAPES] = (frame.head[at - SHAPES] as number) + size * DEGREE * angle;
}

/** Shifts the gaze; the head comes after, and the eyes turn back by what the head has turned. */
function look(seconds: number, seed: number, frame: DrivingFrame): void {
  const now = fixation(seconds, seed);
  const [knotS, size] = made.GAZE_WANDER as [number, number];
  for (let axis = 0; axis < 2; axis++) {
    for (let i = 0; i < 4; i++) TARGETS[i] = target(now - 3 + i, axis, seed);
    const done = eased((seconds - shift(now, seed)) / saccadeS(distance(now, seed)));
    const before = TARGETS[2] as number;
    const drift = size * curve(seconds / knotS, seed, DRIFT_YAW + axis);
    const gaze = before + done * ((TARGETS[3] as number) - before) + drift;
    let head = TARGETS[0] as number; // the shifts before `now - 2` are over
    for (let step = 1; step < 4; step++) {
      const since = seconds - shift(now - 3 + step, seed) - made.HEAD_DELAY_S;
      head += eased(since / made.HEAD_TURN_S) * ((TARGETS[step] as number) - (TARGETS[step - 1] as number));
    }
    frame.head[axis] = (frame.head[axis] as number) + made.HEAD_SHARE * DEGREE * head;
    GAZE[axis] = DEGREE * gaze - (frame.head[axis] as number);
  }
  setGaze(frame, GAZE);
}

/** The number of the fixation that has begun last. */
function fixation(seconds: number, seed: number): number {
  const slot = Math.floor(seconds / made.FIXATION_EVERY_S);
  return seconds >= shift(slot, seed) ? slot : slot - 1;
}

/** When the gaze starts to shift to a fixation. */
function shift(at: number, seed: number): number {
  return made.FIXATION_EVERY_S * (at + made.FIXATION_WINDOW * random(seed, SHIFT, at));
}

/** Where a fixation looks, degrees: yaw to the subject's left (axis 0), pitch up (1). */
function target(at: number, axis: number, seed: number): number {
  let value = 2 * random(seed, YAW + axis, at) - 1;
  if (random(seed, WHERE, at) < made.GAZE_VIEWER_CHANCE) return (made.GAZE_VIEWER_DEG[axis] as number) * value;
  if (axis === 0) value = 0.6 * value + (value >= 0 ? 0.4 : -0.4);
  return (made.GAZE_AWAY_DEG[axis] as number) * value;
}

/** How far the gaze shifts to a fixation, degrees. */
function distance(at: number, seed: number): number {
  const yaw = target(at, 0, seed) - target(at - 1, 0, seed), pitch = target(at, 1, seed) - target(at - 1, 1, seed);
  return Math.sqrt(yaw * yaw + pitch * pitch);
}

function saccadeS(degrees: number): number {
  return made.SACCADE_S + made.SACCADE_S_PER_DEG * degrees;
}

/** How far the lids are closed. */
function blink(seconds: number, seed: number): number {
  const slot = Math.floor(seconds / made.BLINK_EVERY_S);
  const since = seconds - blinkStart(slot, seed);
  const second = random(seed, PAIR, slot) < made.BLINK_PAIR_CHANCE ? lids(since - made.BLINK_PAIR_S) : 0;
  return lids(since) + second;
}

/** When the blink of a slot starts: with the largest gaze shift of its window, else at random. */
function blinkStart(slot: number, seed: number): number {
  const begin = made.BLINK_EVERY_S * slot, end = begin + made.BLINK_WINDOW * made.BLINK_EVERY_S;
  let start = begin + (end - begin) * random(seed, BLINK, slot), most = made.BLINK_WITH_GAZE_DEG;
  for (let at = fixation(begin, seed) + 1; shift(at, seed) < end; at++) {
    const far = distance(at, seed);
    if (far > most) {
      start = shift(at, seed);
      most = far;
    }
  }
  return start;
}

/** How far a blink has closed the lids, by the seconds since its start. */
function lids(since: number): number {
  const opening = since - made.BLINK_CLOSE_S - made.BLINK_CLOSED_S;
  if (opening < 0) return eased(since / made.BLINK_CLOSE_S);
  const left = 1 - Math.min(opening / made.BLINK_OPEN_S, 1);
  return left * left * left * (4 - 3 * left);
}

/** From 0 to 1 with least jerk; held beyond. */
function eased(part: number): number {
  const x = Math.min(Math.max(part, 0), 1);
  return x * x * x * (10 + x * (6 * x - 15));
}

/** A smooth random curve within -1 and 1: the cubic B-spline of random numbers, one a knot. */
function curve(knots: number, seed: number, stream: number): number {
  const knot = Math.floor(knots), x = knots - knot, y = 1 - x;
  const a = 2 * random(seed, stream, knot - 1) - 1, b = 2 * random(seed, stream, knot) - 1;
  const c = 2 * random(seed, stream, knot + 1) - 1, d = 2 * random(seed, stream, knot + 2) - 1;
  const middle = (4 - 6 * x * x + 3 * x * x * x) * b + (4 - 6 * y * y + 3 * y * y * y) * c;
  return (y * y * y * a + middle + x * x * x * d) / 6;
}

/** A number from 0 to below 1. */
function random(seed: number, stream: number, index: number): number {
  return (mixed(mixed(seed + Math.imul(stream, 0x9e3779b9)) ^ index) >>> 0) / 4294967296;
}

/** The finaliser of MurmurHash3 (Appleby, public domain): 32 bits to 32 bits, each of them from all. */
function mixed(bits: number): number {
  bits = Math.imul(bits ^ (bits >>> 16), 0x85ebca6b);
  bits = Math.imul(bits ^ (bits >>> 13), 0xc2b2ae35);
  return bits ^ (bits >>> 16);
}
