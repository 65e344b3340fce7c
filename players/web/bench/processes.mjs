// CPU time of a process and all that it started, from /proc (Linux).
import { readFileSync, readdirSync } from "node:fs";
import { execFileSync } from "node:child_process";

const TICKS_PER_S = Number(execFileSync("getconf", ["CLK_TCK"]));

/** Seconds of user and system time that the living processes of a tree have used. */
export function treeSeconds(root) {
  const children = new Map();
  const ticks = new Map();
  for (const name of readdirSync("/proc")) {
    if (!/^\d+$/.test(name)) continue;
    let text;
    try {
      text = readFileSync(`/proc/${name}/stat`, "utf8");
    } catch {
      continue; // it has ended
    }
    const fields = text.slice(text.lastIndexOf(")") + 2).split(" "); // field 3 of proc(5) is the first
    const parent = Number(fields[1]);
    children.set(parent, [...(children.get(parent) ?? []), Number(name)]);
    ticks.set(Number(name), Number(fields[11]) + Number(fields[12]));
  }
  const sum = (id) => (ticks.get(id) ?? 0) + (children.get(id) ?? []).reduce((total, child) => total + sum(child), 0);
  return sum(root) / TICKS_PER_S;
}
