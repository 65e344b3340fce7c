// Files and downloads that nobody should trust: one AvatarError each, no other exception, no large memory.

import assert from "node:assert/strict";
import { readdirSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import { test } from "node:test";
import { gunzipSync, gzipSync } from "node:zlib";
import { bytes, core, PACKS, random } from "./harness.mjs";

const GOLDEN = ["joints", "joints_exact", "joints_wide", "surface", "surface_without_rig"];
const FUZZ = Number(process.env.AVATAR_FUZZ ?? 0); // see tests/session/fuzz.py
const MUTATIONS = Math.round(2000 * (FUZZ || 0.3));
const SEED = FUZZ ? Date.now() % 2 ** 31 : 15;

/** A pack in parts: the header's JSON, the document, the bytes of the tensors. */
function taken(file) {
  const data = gunzipSync(file);
  const length = Number(data.readBigUInt64LE(0));
  const header = JSON.parse(data.subarray(8, 8 + length).toString());
  return { header, document: JSON.parse(header.__metadata__.pack), body: data.subarray(8 + length) };
}

/** The file of such parts. */
function put({ header, document, body }, level = 1) {
  const said = { ...header, __metadata__: { pack: typeof document === "string" ? document : JSON.stringify(document) } };
  return wrapped(JSON.stringify(said), body, level);
}

function wrapped(head, body, level = 1) {
  const text = Buffer.from(head);
  const length = Buffer.alloc(8);
  length.writeBigUInt64LE(BigInt(text.length));
  return new Uint8Array(gzipSync(Buffer.concat([length, text, body]), { level }));
}

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
const parts = () => taken(whole);

test("what is no pack is told apart", async () => {
  for (const [file, message] of [
    [new Uint8Array(0), /^a.avatar: is not a pack: it does not begin as a gzip file$/],
    [new TextEncoder().encode("<!doctype html><title>404</title>"), /is not a pack/],
    [new Uint8Array(gunzipSync(whole)), /was inflated on its way: the server must send packs as they are/],
    [new Uint8Array(gzipSync("hello")), /cut off/],
    [new Uint8Array(gzipSync(Buffer.alloc(100))), /its header is not JSON/],
    [wrapped("{}", Buffer.alloc(0)), /has no document 'pack'/],
    [wrapped('{"a":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}', Buffer.alloc(4)), /header\.a: is not the entry of a tensor of bytes/],
    [wrapped('{"__metadata__":{"pack":"[}"}}', Buffer.alloc(0)), /its document 'pack' is not JSON/],
    [wrapped('{"__metadata__":{"pack":"[]"}}', Buffer.alloc(0)), /\$: is a list; a JSON object is needed/],
  ]) {
    assert.match((await refusal(file)).message, message);
  }
});

test("a file that was cut off anywhere, or goes on, is refused", async () => {
  for (let length = 2; length < whole.length; length += 307) {
    assert.match((await refusal(whole.subarray(0, length))).message, /cut off|too early/);
  }
  const { header, document, body } = parts();
  for (const more of [Uint8Array.of(7), new TextEncoder().encode("trailing bytes"), new Uint8Array(gzipSync("more"))]) {
    assert.match((await refusal(Uint8Array.of(...whole, ...more))).message, /goes on after its last tensor|damaged/);
  }
  assert.match((await refusal(put({ header, document, body: Buffer.concat([body, Buffer.alloc(1)]) }))).message, /goes on after its last tensor/);
  const damaged = whole.slice();
  damaged[whole.length - 6] ^= 1; // the checksum
  assert.match((await refusal(damaged)).message, /damaged/);
});

test("a bomb is stopped before it takes memory", async () => {
  const before = process.memoryUsage().arrayBuffers;
  const giant = { dtype: "U8", shape: [2 ** 30], data_offsets: [0, 2 ** 30] };
  const bomb = wrapped(JSON.stringify({ __metadata__: { pack: "{}" }, giant }), Buffer.alloc(4 << 20), 9);
  assert.match((await refusal(bomb)).message, /claims 1073741824 bytes in a file of \d+; at most 400 times/);
  const length = Buffer.alloc(9);
  length.writeBigUInt64LE(2n ** 40n);
  assert.match((await refusal(new Uint8Array(gzipSync(length)))).message, /claims a header of 1099511627776 bytes/);
  const { header, document, body } = parts();
  document.avatar.clips[0].frames = 2 ** 32 - 1;
  assert.match((await refusal(put({ header, document, body }))).message, /with it the clips take more than \d+ bytes/);
  assert.ok(process.memoryUsage().arrayBuffers - before < 64 << 20);
});

test("many vertices around few triangles are refused", async () => {
  const pack = taken(bytes("surface", "pack.avatar"));
  const sections = pack.document.program.buffers.find((one) => one.name === "SurfaceStatic").sections;
  sections.find((one) => one.name === "vertex_triangle_ptr").count = 2 ** 32 - 1;
  assert.match((await refusal(put(pack))).field, /vertex_triangle_ptr|count/);
});

test("a newer version says what to do", async () => {
  const set = (change) => {
    const pack = parts();
    change(pack.document);
    return put(pack);
  };
  for (const [change, field, message] of [
    [(d) => (d.asset.version = "2.0"), "$.asset.version", /is 2\.0 .* update avatar-export-player/],
    [(d) => (d.asset.minVersion = "1.7"), "$.asset.version", /needs a reader of 1\.7.* update avatar-export-player/],
    [(d) => (d.shaders = 2), "$.shaders", /needs kernels of version 2; this player has 1: update avatar-export-player/],
    [(d) => (d.extensionsRequired = ["hair"]), "$.extensionsRequired", /'hair' is not known/],
    [(d) => (d.format = "avatar-export"), "$.format", /knows avatar-pack/],
    [(d) => (d.program.levels[0].deform[0].entry = "blend2"), "level 0, deform pass 0 (blend2)", /a newer version may know it/],
    [(d) => (d.program.buffers[2].sections[0].codec = "rans"), "$.program.buffers[2].sections[0].codec", /'rans' is unknown to this reader/],
  ]) {
    const error = await refusal(set(change));
    assert.equal(error.field, field);
    assert.match(error.message, message);
  }
  assert.equal((await core.load(set((d) => (d.asset.version = "1.9")))).name, "Full Ävatar");
});

test("facts that do not fit are named", async () => {
  const ofRig = (name) => (d) => (d.arrays[name].shape = [1]);
  for (const [change, field] of [
    [(d) => (d.avatar.name = 7), "$.avatar.name"],
    [(d) => d.avatar.expressions.pop(), "array rig.joint_basis"],
    [(d) => (d.avatar.expressions[1].name = "jawOpen"), "$.avatar.expressions"],
    [(d) => (d.avatar.expressions[1].range = [0, "1"]), "$.avatar.expressions[1].range[1]"],
    [(d) => (d.avatar.late_morphs = ["left"]), "$.program.pose.late"],
    [(d) => (d.avatar.frame.handedness = "both"), "$.avatar.frame.handedness"],
    [(d) => (d.avatar.driving.head_joint = "nek"), "driving.head_joint"],
    [(d) => (d.avatar.driving.outputs[0] = "expression/none"), "driving.outputs"],
    [(d) => d.avatar.driving.matrix[0].pop(), "$.avatar.driving.matrix[0]"],
    [(d) => (d.avatar.rules.rotation_joint = "tail"), "$.avatar.rules.rotation_joint"],
    [(d) => (d.levels[0].groups[0].count = 23), "$.levels[0].groups[1]"],
    [(d) => (d.levels[0].groups[3].count = 9), "$.levels[0].groups"],
    [(d) => (d.levels[0].groups[2].joint_mix = { tail: 1 }), "group lower_teeth, joint_mix"],
    [(d) => (d.levels[0].groups[2].joint_mix = {}), "group lower_teeth"],
    [(d) => (d.levels[0].groups[0].binding = "glue"), "$.levels[0].groups[0].binding"],
    [(d) => d.levels.push(d.levels[0]), "$.program.levels"],
    [(d) => (d.avatar.clips[0].fps = 0), "$.avatar.clips[0].fps"],
    [(d) => (d.avatar.clips[0].frames = 6), "array clips.0.expression_weights.codes"],
    [(d) => delete d.arrays["clips.1.late_weights.scale"], "array clips.1.late_weights.scale"],
    [(d) => delete d.arrays["rig.parents"], "array rig.parents"],
    [(d) => (d.arrays["rig.parents"].tensor = "toString"), "array rig.parents"],
    [(d) => (d.arrays["rig.rest_local"].tensor = "rig.inverse_bind_matrix"), null],
    [ofRig("rig.joint_basis"), "array rig.joint_basis"],
    [(d) => (d.arrays["rig.parents"].type = "u32"), "array rig.parents"],
    [(d) => (d.program.pose.joints = 25), "pose"],
    [(d) => d.program.buffers.push(d.program.buffers[0]), "buffer Pose"],
    [(d) => delete d.program.levels[0].view, "$.program.levels[0].view"],
    [(d) => (d.program.levels[0].deform[0].rows = "48"), "$.program.levels[0].deform[0].rows"],
    [(d) => (d.program.levels[0].deform[0].constants.constructor = 1), "level 0, deform pass 0 (blend), constants"],
  ]) {
    const pack = parts();
    change(pack.document);
    if (field === null) {
      await core.load(put(pack));
    } else {
      assert.equal((await refusal(put(pack))).field, field, String(change));
    }
  }
});

test("an anchor group without anchors, a joint that follows its child, a clip that stretches are refused", async () => {
  const written = (array, at, value) => {
    const pack = parts();
    const { tensor, type } = pack.document.arrays[array];
    const [begin, end] = pack.header[tensor].data_offsets;
    const planes = pack.body.subarray(begin, end);
    const data = Buffer.alloc(4);
    type === "f32" ? data.writeFloatLE(value) : data.writeInt32LE(value);
    for (let b = 0; b < 4; b++) planes[b * (planes.length / 4) + at] = data[b];
    return put(pack);
  };
  for (const [file, field] of [
    [written("rig.parents", 1, 1), "array rig.parents"],
    [written("rig.parents", 1, -2), "array rig.parents"],
    [written("rig.rest_local", 12, 1), "array rig.rest_local[0]"],
    [written("rig.rest_local", 3, NaN), "array rig.rest_local"],
    [written("rig.corrective_joints", 0, 5), "array rig.corrective_joints"],
    [written("rig.anchor_vertices", 0, 20), "array rig.anchor_vertices"],
    [written("clips.0.world_from_avatar.scale", 0, 2), "$.avatar.clips[0]"],
    [written("clips.0.joint_delta.scale", 0, Infinity), "array clips.0.joint_delta"],
  ]) {
    assert.equal((await refusal(file)).field, field);
  }
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

const MUTATORS = [
  (file, pick) => {
    const other = file.slice();
    for (let n = 1 + pick(4); n > 0; n--) other[pick(other.length)] = pick(256);
    return other;
  },
  (file, pick) => file.slice(0, pick(file.length)),
  (file, pick) => {
    const data = gunzipSync(file);
    for (let n = 1 + pick(8); n > 0; n--) data[pick(data.length)] = pick(256);
    return new Uint8Array(gzipSync(data, { level: 1 }));
  },
  (file, pick) => {
    const pack = taken(file);
    for (let n = 1 + pick(3); n > 0; n--) changed(pack.document, pick);
    return put(pack);
  },
  (file, pick) => {
    const pack = taken(file);
    changed(pack.document.program, pick);
    return put(pack);
  },
  (file, pick) => {
    const pack = taken(file);
    changed(pack.header, pick);
    return put(pack);
  },
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

test("a download is loaded, and tells how far it is", async () => {
  const told = [];
  const avatar = await served(
    (_, response) => response.writeHead(200, { "content-length": whole.length }).end(whole),
    (url) => core.load(new URL(url), { onProgress: (...at) => told.push(at) }),
  );
  assert.equal(avatar.bytes, whole.length);
  assert.deepEqual([told[0], told.at(-1)], [[0, whole.length], [whole.length, whole.length]]);
  const chunked = await served(
    (_, response) => {
      response.write(whole.subarray(0, 9000));
      response.end(whole.subarray(9000));
    },
    (url) => core.load(url, { onProgress: (_, total) => told.push(total) }),
  );
  assert.equal(chunked.bytes, whole.length);
  assert.equal(told.at(-1), null);
});

test("downloads that fail say how", async () => {
  for (const [answer, message] of [
    [(_, response) => response.writeHead(404).end("no"), /^a.avatar: cannot be loaded: the server answers 404 Not Found$/],
    [
      (_, response) => {
        response.writeHead(200, { "content-length": whole.length });
        response.write(whole.subarray(0, 5000));
        setTimeout(() => response.destroy(), 30);
      },
      /^a.avatar: was cut off after 5000 of \d+ bytes/,
    ],
    [(_, response) => response.writeHead(200, { "content-length": 2 ** 31 }).flushHeaders(), /has 2147483648 bytes; 1073741824 are the most/],
    [(_, response) => response.writeHead(200, { "content-encoding": "gzip" }).end(whole), /was inflated on its way/],
    [(_, response) => response.end("<html>"), /is not a pack/],
  ]) {
    const error = await served(answer, (url) => refusal(url, { name: undefined }));
    assert.match(error.message, message);
  }
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

test("every pack of the cases is sound", () => assert.ok(GOLDEN.every((name) => PACKS.includes(name))));
