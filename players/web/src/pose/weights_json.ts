// ARKit weights over time as JSON, from any tool: exporter/avatar_export/driving/expression_json.py describes the three
// spellings (one's own, LAM_Audio2Expression's, Audio2Face's), and reads the same.

import { AvatarError, noSuch } from "../errors.js";
import { ARKIT_NAMES, channelOf, CHANNELS } from "./arkit.js";
import { Recording } from "./recording.js";

const RATES = [1, 1000] as const; // range of frames a second
const RATE_ERROR = 0.01; // by which times may leave the rate
const MOST = 100; // a weight is in 0..1; larger values are errors

type Json = Readonly<Record<string, unknown>>;

/** Whether a text is such a JSON rather than a CSV. */
export function isWeightsJson(text: string): boolean {
  return /^\uFEFF?\s*\{/.test(text);
}

/** The recording in such a text. Throws AvatarError of `owner`; it names the frame (from 0). */
export function parseWeightsJson(text: string, owner = "the recording"): Recording {
  try {
    return parse(text);
  } catch (error) {
    throw error instanceof AvatarError ? error.of(owner) : error;
  }
}

function parse(text: string): Recording {
  const document = documentOf(text);
  const audio2face = "facsNames" in document;
  const keys = audio2face
    ? { names: "facsNames", frames: "weightMat", fps: "exportFps" }
    : { names: "names", frames: "frames", fps: "metadata" in document ? "metadata.fps" : "fps" };
  const names = listOf(document, keys.names);
  const frames = listOf(document, keys.frames);
  const fps = keys.fps.split(".").reduce<unknown>((value, key) => (isObject(value) ? value[key] : undefined), document);
  if (!isNumber(fps) || fps < RATES[0] || fps > RATES[1]) {
    throw new AvatarError(`is ${String(JSON.stringify(fps)).slice(0, 40)}, not frames per second`, { field: keys.fps });
  }
  const columns = columnsOf(names, keys.names);
  const times = new Float64Array(frames.length);
  const channels = new Float64Array(frames.length * CHANNELS.length);
  frames.forEach((frame, row) => {
    const field = `${keys.frames}[${row}]`;
    const weights = weightsOf(frame, names.length, field);
    times[row] = timeOf(frame, row / fps, row > 0 ? (times[row - 1] as number) : -Infinity, field);
    columns.forEach((channel, at) => {
      if (channel !== null) channels[row * CHANNELS.length + channel] = weights[at] as number;
    });
  });
  const missing = CHANNELS.filter((_, channel) => !columns.includes(channel));
  const first = times[0] ?? 0;
  const recording = new Recording(times.map((time) => time - first), channels, missing);
  if (frames.length > 1 && Math.abs(recording.fps / fps - 1) > RATE_ERROR) {
    throw new AvatarError(`is ${fps}, but the times of its frames make ${recording.fps}`, { field: keys.fps });
  }
  return recording;
}

function documentOf(text: string): Json {
  let found: unknown;
  try {
    found = JSON.parse(text.replace(/^\uFEFF/, ""));
  } catch {
    throw new AvatarError("is not valid JSON");
  }
  if (!isObject(found)) throw new AvatarError("is no JSON object with names, fps and frames");
  return found;
}

function listOf(document: Json, key: string): readonly unknown[] {
  const found = document[key];
  if (!Array.isArray(found)) throw new AvatarError("is missing or not a list", { field: key });
  return found;
}

/** The channel of each name; null: ARKit has none. */
function columnsOf(names: readonly unknown[], field: string): (number | null)[] {
  const columns = names.map((name) => {
    const channel = typeof name === "string" ? channelOf(name) : null;
    const at = channel === null ? -1 : ARKIT_NAMES.indexOf(channel);
    return at < 0 ? null : at;
  });
  const known = columns.filter((at) => at !== null);
  const twice = known.find((at, i) => known.indexOf(at) !== i);
  if (twice !== undefined) throw new AvatarError(`has ${ARKIT_NAMES[twice]} twice`, { field });
  if (known.length === 0) throw noSuch("ARKit name", names.join(", ").slice(0, 60), ARKIT_NAMES, { field });
  return columns;
}

function weightsOf(frame: unknown, count: number, field: string): readonly unknown[] {
  const inside = isObject(frame);
  if (inside && Array.isArray(frame["rotation"]) && frame["rotation"].length > 0) {
    throw new AvatarError("is not empty; nobody states the unit of rotations, so remove them", { field: `${field}.rotation` });
  }
  const weights = inside ? frame["weights"] : frame;
  const where = { field: inside ? `${field}.weights` : field };
  if (!Array.isArray(weights) || weights.length !== count || !weights.every(isNumber)) {
    throw new AvatarError(`expected ${count} numbers, as many as names`, where);
  }
  const wrong = weights.find((weight: number) => Math.abs(weight) > MOST);
  if (wrong !== undefined) throw new AvatarError(`${wrong} is not a weight`, where);
  return weights;
}

function timeOf(frame: unknown, usual: number, before: number, field: string): number {
  const time = isObject(frame) && "time" in frame ? frame["time"] : usual;
  if (isNumber(time) && time > before) return time;
  throw new AvatarError("is not a number of seconds after the one before", { field: `${field}.time` });
}

function isObject(value: unknown): value is Json {
  return typeof value === "object" && value !== null && !Array.isArray(value);
}

function isNumber(value: unknown): value is number {
  return typeof value === "number" && Number.isFinite(value);
}
