// The core as one module, and readers of the cases that Python wrote into the folder AVATAR_CASES.

import { readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { imported } from "../../bundle.mjs";

export const core = await imported({ entryPoints: [join(dirname(fileURLToPath(import.meta.url)), "internals.ts")] });

/** The bytes of a file of the cases. */
export function bytes(...path) {
  const folder = process.env.AVATAR_CASES;
  assert.ok(folder, "AVATAR_CASES is not set: tests/players/test_web_core.py runs these tests");
  return new Uint8Array(readFileSync(join(folder, ...path)));
}

export function json(...path) {
  return JSON.parse(new TextDecoder().decode(bytes(...path)));
}

/** Names of the packs. */
export const PACKS = json("packs.json").packs;

/** A pack, loaded. */
export function loaded(name) {
  return core.load(bytes(name, "pack.avatar"), { name });
}

const KINDS = { F64: Float64Array, F32: Float32Array, I32: Int32Array, U32: Uint32Array, I64: BigInt64Array };

/** The arrays of a safetensors file: name -> { shape, values }. */
export function tensors(...path) {
  const data = bytes(...path);
  const length = Number(new DataView(data.buffer, data.byteOffset).getBigUint64(0, true));
  const header = JSON.parse(new TextDecoder().decode(data.subarray(8, 8 + length)));
  const found = {};
  for (const [name, { dtype, shape, data_offsets: [begin, end] }] of Object.entries(header)) {
    if (name !== "__metadata__") {
      found[name] = { shape, values: new KINDS[dtype](data.slice(8 + length + begin, 8 + length + end).buffer) };
    }
  }
  return found;
}

/** Row `index` of a tensor. */
export function row({ shape, values }, index) {
  const size = values.length / shape[0];
  return values.subarray(index * size, (index + 1) * size);
}

export function sha(array) {
  return createHash("sha256").update(new Uint8Array(array.buffer, array.byteOffset, array.byteLength)).digest("hex");
}

/** Asserts that every number is within `limit` of the wanted one. */
export function near(got, want, limit, what) {
  assert.equal(got.length, want.length, what);
  for (let i = 0; i < want.length; i++) {
    assert.ok(Math.abs(got[i] - want[i]) <= limit, `${what}[${i}] is ${got[i]}, not ${want[i]}; ${limit} is allowed`);
  }
}

/** The largest size of a number, at least 1. */
export function largest(values) {
  return values.reduce((most, value) => Math.max(most, Math.abs(value)), 1);
}

export const ROUNDING = 2 ** -24; // of float32
