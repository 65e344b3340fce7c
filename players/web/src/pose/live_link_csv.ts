// Live Link Face CSV: a timecode, a count and up to 61 named columns per row.
//
// Columns are matched by name in any order and case; unknown columns are ignored. The timecode is HH:MM:SS:FF.sss,
// where FF.sss counts frames of a rate that the file does not store: the smallest common rate above the highest FF.

import { AvatarError, noSuch } from "../errors.js";
import { channelOf, CHANNELS } from "./arkit.js";
import { csvRows, type Row } from "./csv.js";
import { Recording } from "./recording.js";

const RATES = [24, 25, 30, 48, 50, 60, 120, 240];
const DEFAULT_RATE = 60; // of a file that stays within one second
const DAY = 86400; // seconds
const MOST = 100; // weights are in 0..1 and angles in -pi..pi; larger values are errors
const TIMECODE = /^([0-9]{1,2}):([0-9]{1,2}):([0-9]{1,2})[:;]([0-9]{1,3}(?:\.[0-9]{1,9})?)$/;
const NUMBER = /^[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?$/;
const SHOWN = 40; // letters of a wrong field

/** A frame's time of day: whole seconds, frames into the second, and the line that says so. */
interface Code {
  readonly seconds: number;
  readonly frames: number;
  readonly line: number;
}

/**
 * The recording in the text of a Live Link Face CSV. A row whose BlendShapeCount is 0 has no face: it is left out and
 * counted. Throws AvatarError of `owner`; it names the line (from 1) and the column.
 */
export function parseLiveLinkCsv(text: string, owner = "the recording"): Recording {
  try {
    return parse(text);
  } catch (error) {
    throw error instanceof AvatarError ? error.of(owner) : error;
  }
}

function parse(text: string): Recording {
  const rows = csvRows(text);
  const header: Row = rows.next().value ?? { line: 1, fields: [] };
  const columns = columnsOf(header);
  const codes: Code[] = [];
  const channels: number[] = [];
  let withoutFace = 0;
  for (const row of rows) {
    if (row.fields.length === 0) continue;
    if (row.fields.length !== header.fields.length) {
      const found = `line ${row.line} has ${row.fields.length} fields`;
      throw new AvatarError(`${found}, but the header has ${header.fields.length}`);
    }
    if (columns.count !== null && row.fields[columns.count]?.trim() === "0") {
      withoutFace += 1;
      continue;
    }
    codes.push(codeOf(row.fields[columns.timecode] as string, row.line));
    for (const at of columns.channels) channels.push(at === null ? 0 : numberOf(row, at, header));
  }
  if (codes.length === 0) throw new AvatarError("has no frame with a face");
  const missing = CHANNELS.filter((_, i) => columns.channels[i] === null);
  return new Recording(timesOf(codes), Float64Array.from(channels), missing, withoutFace);
}

/** Which column holds what; null: none. */
interface Columns {
  readonly timecode: number;
  readonly count: number | null;
  readonly channels: readonly (number | null)[]; // in the order of CHANNELS
}

function columnsOf({ fields, line }: Row): Columns {
  const found = new Map<string, number>();
  fields.forEach((title, at) => {
    const plain = title.trim().toLowerCase();
    const name = plain === "timecode" || plain === "blendshapecount" ? plain : channelOf(title);
    if (name !== null) {
      const first = found.get(name);
      if (first !== undefined) {
        throw new AvatarError(`line ${line}: columns ${first + 1} and ${at + 1} are both ${name}`);
      }
      found.set(name, at);
    }
  });
  const timecode = found.get("timecode");
  if (timecode === undefined) {
    throw new AvatarError(`line ${line}: has no Timecode column; a Live Link Face CSV is needed`);
  }
  const channels = CHANNELS.map((name) => found.get(name) ?? null);
  if (channels.every((at) => at === null)) {
    throw noSuch("ARKit column", fields.join(", ").slice(0, 60), CHANNELS, { field: `line ${line}` });
  }
  return { timecode, count: found.get("blendshapecount") ?? null, channels };
}

function numberOf(row: Row, at: number, header: Row): number {
  const text = row.fields[at]?.trim() ?? "";
  const value = NUMBER.test(text) ? Number(text) : NaN;
  if (!(Math.abs(value) <= MOST)) {
    throw new AvatarError(`line ${row.line}: '${text.slice(0, SHOWN)}' is not a weight or an angle in radians`, {
      field: header.fields[at]?.trim(),
    });
  }
  return value;
}

function codeOf(text: string, line: number): Code {
  const match = TIMECODE.exec(text.trim());
  if (match === null) {
    const message = `line ${line}: '${text.slice(0, SHOWN)}' is not a timecode HH:MM:SS:FF.sss`;
    throw new AvatarError(message, { field: "Timecode" });
  }
  const [hours, minutes, seconds, frames] = match.slice(1).map(Number) as [number, number, number, number];
  if (hours > 23 || minutes > 59 || seconds > 59 || frames >= (RATES[RATES.length - 1] as number)) {
    throw new AvatarError(`line ${line}: '${text.slice(0, SHOWN)}' is not a time of day`, { field: "Timecode" });
  }
  return { seconds: 3600 * hours + 60 * minutes + seconds, frames, line };
}

/** Seconds from the first frame; midnight may be crossed once. */
function timesOf(codes: readonly Code[]): Float64Array {
  const highest = codes.reduce((most, code) => Math.max(most, code.frames), 0);
  const crosses = codes.some((code) => code.seconds !== codes[0]?.seconds);
  const rate = RATES.find((one) => one > highest && (crosses || one >= DEFAULT_RATE)) as number;
  const times = Float64Array.from(codes, (code) => code.seconds + code.frames / rate);
  const falls = (i: number): boolean => i > 0 && (times[i] as number) - (times[i - 1] as number) < -DAY / 2;
  const midnights = codes.map((_, i) => i).filter(falls);
  if (midnights.length === 1) {
    for (let i = midnights[0] as number; i < times.length; i++) times[i] = (times[i] as number) + DAY;
  }
  const first = times[0] as number;
  codes.forEach((code, i) => {
    if (i > 0 && (times[i] as number) < (times[i - 1] as number)) {
      throw new AvatarError(`line ${code.line} is earlier than the one before`, { field: "Timecode" });
    }
  });
  return times.map((time) => time - first);
}
