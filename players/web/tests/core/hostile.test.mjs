// Files and downloads that nobody should trust: one AvatarError each, no other exception, no large memory.

import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import { test } from "node:test";
import { gunzipSync, gzipSync } from "node:zlib";
import { repacked } from "../parts.mjs";
import { bytes, core, json, random } from "./harness.mjs";

const GOLDEN = ["joints", "joints_exact", "joints_wide", "surface", "surface_without_rig"];
const FUZZ = Number(process.env.AVATAR_FUZZ ?? 0); // see tests/session/fuzz.py
const MUTATIONS = Math.round(2000 * (FUZZ || 0.3));
const SEED = FUZZ ? Date.now() % 2 ** 31 : 15;

async function refusal(file, options) {
  const error = await core.load(file, { name: "a.avatar", ...options }).then(
    () => assert.fail("was accepted"),
    (thrown) => thrown,
  );
  assert.equal(error.name, "AvatarError", error.stack);
  assert.equal(error.owner, "a.avatar");
  assert.ok(!error.message.includes("\n") && error.message.length < 400, error.message);
  return error;
}

const whole = bytes("joints", "pack.avatar");

test("what every reader refuses is refused, and named", async () => {
  const before = process.memoryUsage().arrayBuffers;
  for (const row of json("hostile", "hostile.json")) {
    const { what, file, field, message, taken } = { ...row, ...row.web };
    if (taken) {
      await core.load(bytes("hostile", file));
      continue;
    }
    const error = await refusal(bytes("hostile", file));
    assert.ok(field === undefined || error.field === field, `${what}: ${error.message}`);
    assert.ok(error.message.includes(message.replace("com.avatar-export.player", "avatar-export-player")), `${what}: ${error.message}`);
  }
  assert.ok(process.memoryUsage().arrayBuffers - before < 64 << 20);
});

test("what every reader takes is taken", async () => {
  for (const file of json("hostile", "sound.json")) await core.load(bytes("hostile", file));
});

/** Any value in a JSON document, changed at random. */
function changed(value, pick) {
  if (typeof value === "object" && value !== null) {
    const keys = Object.keys(value);
    if (keys.length > 0 && pick(40) > 0) {
      const key = keys[pick(keys.length)];
      if (pick(30) === 0) {
        Array.isArray(value) ? value.splice(Number(key), 1) : delete value[key];
      } else {
        value[key] = changed(value[key], pick);
      }
      return value;
    }
  }
  if (typeof value === "number" && pick(4) > 0) {
    return [value + 1, value - 1, -value, 2 * value + 1, 2 ** 31, 2 ** 32 - 1, 1e300, 0.5][pick(8)];
  }
  return [null, "x", [], {}, -1, 0, 1e9, true, "__proto__", value][pick(10)];
}

/** A file with `count` of its bytes changed. */
function noisy(file, count, pick) {
  const other = Uint8Array.from(file);
  for (let n = 0; n < count; n++) other[pick(other.length)] = pick(256);
  return other;
}

const MUTATORS = [
  (file, pick) => noisy(file, 1 + pick(4), pick),
  (file, pick) => file.slice(0, pick(file.length)),
  (file, pick) => new Uint8Array(gzipSync(noisy(gunzipSync(file), 1 + pick(8), pick), { level: 1 })),
  (file, pick) => repacked(file, ({ document }) => Array.from({ length: 1 + pick(3) }, () => changed(document, pick))),
  (file, pick) => repacked(file, ({ document }) => changed(document.program, pick)),
  (file, pick) => repacked(file, ({ header }) => changed(header, pick)),
];

test(`${MUTATIONS} changed packs load, or are refused in one line`, async () => {
  const pick = random(SEED);
  const files = GOLDEN.map((name) => bytes(name, "pack.avatar"));
  const counts = { loaded: 0, refused: 0 };
  let most = 0;
  const one = async (index) => {
    const file = MUTATORS[index % MUTATORS.length](files[pick(files.length)], pick);
    try {
      const avatar = await core.load(file);
      new core.Poser(avatar).update(new core.Pose(avatar));
      counts.loaded += 1;
    } catch (error) {
      assert.equal(error.name, "AvatarError", `seed ${SEED}, mutation ${index}: ${error.stack}`);
      assert.ok(!error.message.includes("\n") && error.message.length < 500, error.message);
      counts.refused += 1;
    }
    most = Math.max(most, process.memoryUsage().arrayBuffers);
  };
  for (let index = 0; index < MUTATIONS; index += 4) {
    await Promise.all([one(index), one(index + 1), one(index + 2), one(index + 3)]);
  }
  assert.ok(counts.loaded > MUTATIONS / 100 && counts.refused > MUTATIONS / 2, JSON.stringify(counts));
  assert.ok(most < 256 << 20, `${most} bytes`);
});

test("packs that once broke a reader load, or are refused in one line", async () => {
  for (const name of readdirSync(join(process.env.AVATAR_CASES, "found"))) {
    await core.load(bytes("found", name)).catch((error) => assert.equal(error.name, "AvatarError", error.stack));
  }
});

/** A server of one answer; `use` gets its address. */
async function served(answer, use) {
  const server = createServer(answer);
  await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
  try {
    return await use(`http://127.0.0.1:${server.address().port}/faces/a.avatar?v=1#x`);
  } finally {
    server.closeAllConnections();
    server.close();
  }
}

test("a download is loaded, and reports how far it is", async () => {
  const size = whole.length;
  const loadedOf = async (answer) => {
    const reports = [];
    const avatar = await served(answer, (url) => core.load(new URL(url), { onProgress: (...at) => reports.push(at) }));
    assert.equal(avatar.bytes, size);
    return [reports[0], reports.at(-1)];
  };
  const reports = await loadedOf((_, response) => response.writeHead(200, { "content-length": size }).end(whole));
  assert.deepEqual(reports, [[0, size], [size, size]]);
  const chunked = await loadedOf((_, response) => {
    response.write(whole.subarray(0, 9000));
    response.end(whole.subarray(9000));
  });
  assert.deepEqual(chunked, [[0, null], [size, null]]);
});

test("downloads that fail say how", async () => {
  const cut = (_, response) => {
    response.writeHead(200, { "content-length": whole.length }).write(whole.subarray(0, 5000));
    setTimeout(() => response.destroy(), 30);
  };
  for (const [answer, message] of [
    [(_, response) => response.writeHead(404).end("no"), /^a.avatar: cannot be loaded: the server answers 404 Not Found$/],
    [cut, /^a.avatar: was cut off after 5000 of \d+ bytes/],
    [(_, response) => response.writeHead(200, { "content-length": 2 ** 31 }).flushHeaders(), /has 2147483648 bytes; 1073741824 are the most/],
    [(_, response) => response.writeHead(200, { "content-encoding": "gzip" }).end(whole), /was inflated on its way/],
    [(_, response) => response.end("<html>"), /is not a pack/],
  ]) assert.match((await served(answer, (url) => refusal(url, { name: undefined }))).message, message);
  assert.match((await refusal("http://127.0.0.1:1/a.avatar", { name: undefined })).message, /cannot be loaded: .*is the address right/);
});

test("a download that is aborted rejects with the signal's reason", async () => {
  const reason = new Error("enough");
  const stop = new AbortController();
  const slow = (_, response) => response.writeHead(200, { "content-length": whole.length }).write(whole.subarray(0, 100));
  await served(slow, async (url) => {
    const loading = core.load(url, { signal: stop.signal, onProgress: (at) => at > 0 && stop.abort(reason) });
    await assert.rejects(loading, (error) => error === reason);
    await assert.rejects(core.load(url, { signal: stop.signal }), (error) => error === reason);
  });
});
