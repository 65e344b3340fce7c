import type { Json } from "./json.js";
import type { Buffer, Constant, Level, Pass, Program } from "./model.js";

const MOST_PASSES = 4096;
const MOST_LEVELS = 16;
const MOST_CHUNKS = 1024;
const MOST_TEXT = 64; // letters of an entry, a prefix, the name of a value of the frame

/** The program of a document, with its buffers. Throws AvatarError for what the schema does not allow. */
export function readProgram(said: Json, buffers: ReadonlyMap<string, Buffer>): Program {
  const pose = said.at("pose");
  return {
    buffers,
    mesh: passes(said.at("mesh")),
    levels: said.at("levels").list(1, MOST_LEVELS).map(level),
    pose: {
      weights: pose.at("weights").whole(),
      features: pose.at("features").whole(),
      late: pose.at("late").whole(),
      joints: pose.at("joints").whole(),
    },
    poseFloats: said.at("pose_floats").whole(),
    readsMesh: said.at("reads_mesh").flag(),
  };
}

function level(said: Json): Level {
  return {
    prefix: said.at("prefix").text(MOST_TEXT),
    chunks: said.at("chunks").list(1, MOST_CHUNKS).map((chunk) => {
      const [first, count] = chunk.list(2, 2).map((one) => one.whole());
      return { first: first as number, count: count as number };
    }),
    deform: passes(said.at("deform")),
    view: passes(said.at("view")),
  };
}

function passes(said: Json): Pass[] {
  return said.list(0, MOST_PASSES).map((one) => ({
    entry: one.at("entry").text(MOST_TEXT),
    rows: one.at("rows").whole(),
    buffers: record(one.at("buffers"), (name) => name.text()),
    constants: record(one.at("constants"), constant),
  }));
}

/** An object without a prototype, so that no name of JavaScript's own is found in it. */
function record<T>(said: Json, read: (member: Json) => T): Record<string, T> {
  const found = Object.create(null) as Record<string, T>;
  for (const [name, member] of said.entries()) found[name] = read(member);
  return found;
}

function constant(said: Json): Constant {
  if (typeof said.value === "string") return said.text(MOST_TEXT);
  return Array.isArray(said.value) ? said.list(0, 4).map((one) => one.number()) : said.number();
}
