// How a client gets its job and gives its answer: JSON on standard input and output, arrays in one raw file.
import fs from "node:fs";

export const job = JSON.parse(fs.readFileSync(0, "utf8"));

// Standard output is the answer's alone; libraries greet on it.
console.log = console.info = console.debug = console.error;

/** A file's bytes, at the start of a buffer of their own. */
export function readBytes(path) {
  return Uint8Array.from(fs.readFileSync(path));
}

/** Index of the item with this name; an error says which there are. */
export function indexOf(name, items) {
  const found = items.findIndex((item) => item.name === name);
  if (found < 0) throw new Error(`no ${name} among ${items.map((item) => item.name)}`);
  return found;
}

/** Every pose of the job, each from rest: its vertices go to arrays["pose/K"]. */
export function takePoses(arrays, toRest, setPose, posed) {
  job.poses.forEach((pose, k) => {
    toRest();
    setPose(pose);
    arrays[`pose/${k}`] = posed();
  });
}

/** Ends the client. `arrays`: name -> Float32Array, Uint32Array or Uint8Array. */
export function answer(facts, arrays = {}) {
  const entries = Object.entries(arrays);
  const kinds = { Float32Array: "<f4", Uint32Array: "<u4", Uint8Array: "|u1", Uint8ClampedArray: "|u1" };
  const layout = entries.map(([name, array]) => [name, kinds[array.constructor.name], array.length]);
  const bytes = entries.map(([, array]) => Buffer.from(array.buffer, array.byteOffset, array.byteLength));
  fs.writeFileSync(job.out, Buffer.concat(bytes));
  fs.writeSync(1, JSON.stringify({ ...facts, arrays: layout }));
  process.exit(0);
}
