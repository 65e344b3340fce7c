// Writes a recording as the CSV of Live Link Face, which everything here plays. exporter/avatar_export/live/recording.py writes
// the same columns.

import { CHANNELS } from "./arkit.js";
import type { Recording } from "./recording.js";

const RATE = 60; // frames of the timecode a second
const FIRST = 59 / RATE; // seconds of the first row: every reader finds the rate by it
const DIGITS = 9; // as many as a float32 needs

/** The text of a CSV: times to a thousandth of a frame of 1/60 s, numbers to nine digits. */
export function liveLinkCsv(recording: Recording): string {
  const titles = CHANNELS.map((name) => name.charAt(0).toUpperCase() + name.slice(1));
  const rows = Array.from(recording.times, (time, row) => {
    const values = recording.channels.subarray(row * CHANNELS.length, (row + 1) * CHANNELS.length);
    return [timecode(FIRST + time), CHANNELS.length, ...Array.from(values, (value) => Number(value.toPrecision(DIGITS)))].join(",");
  });
  return [["Timecode", "BlendShapeCount", ...titles].join(","), ...rows, ""].join("\n");
}

/** HH:MM:SS:FF.sss of a time since midnight; after a day it begins again. */
function timecode(seconds: number): string {
  const thousandths = Math.round(seconds * RATE * 1000);
  const whole = Math.floor(thousandths / (RATE * 1000));
  const frames = thousandths % (RATE * 1000);
  const two = (value: number): string => String(value).padStart(2, "0");
  const clock = [Math.floor(whole / 3600) % 24, Math.floor(whole / 60) % 60, whole % 60, Math.floor(frames / 1000)].map(two).join(":");
  return `${clock}.${String(frames % 1000).padStart(3, "0")}`;
}
