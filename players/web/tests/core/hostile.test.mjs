// Files and downloads that nobody should trust: one AvatarError each, no other exception, no large memory.

import assert from "node:assert/strict";
import { createServer } from "node:http";
import { test } from "node:test";
import { bytes, core, json } from "./harness.mjs";

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
    const { what, file, field, message } = { ...row, ...row.web };
    const error = await refusal(bytes("hostile", file));
    assert.ok(field === undefined || error.field === field, `${what}: ${error.message}`);
    assert.ok(error.message.includes(message.replace("com.avatar-export.player", "avatar-export-player")), `${what}: ${error.message}`);
  }
  assert.ok(process.memoryUsage().arrayBuffers - before < 64 << 20);
});

test("what every reader takes is taken", async () => {
  for (const file of json("hostile", "sound.json")) await core.load(bytes("hostile", file));
});

test("packs that were changed by chance, or once broke a reader, load or are refused in one line", async () => {
  const files = bytes("mutated.bin");
  const counts = { loaded: 0, refused: 0 };
  let most = 0;
  for (let at = 0; at < files.length; ) {
    const end = at + 4 + new DataView(files.buffer, files.byteOffset + at).getUint32(0, true);
    try {
      const avatar = await core.load(files.slice(at + 4, end));
      new core.Poser(avatar).update(new core.Pose(avatar));
      counts.loaded += 1;
    } catch (error) {
      assert.equal(error.name, "AvatarError", `at ${at}: ${error.stack}`);
      assert.ok(!error.message.includes("\n") && error.message.length < 500, error.message);
      counts.refused += 1;
    }
    most = Math.max(most, process.memoryUsage().arrayBuffers);
    at = end;
  }
  assert.ok(counts.loaded > counts.refused / 10 && counts.refused > counts.loaded / 4, JSON.stringify(counts));
  assert.ok(most < 256 << 20, `${most} bytes`);
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
    [(_, response) => response.end("<html>"), /answers an HTML page, not this file/],
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

test("an alpha that no splat reaches, or that is none, writes no depth", () => {
  assert.deepEqual([undefined, 0.5, 0.99].map((depthAlpha) => core.depthAlphaOf({ depthAlpha })), [null, 0.5, 0.99]);
  for (const depthAlpha of [0, -1, 1, NaN, "0.5", null]) {
    const message = `AvatarScene: depthAlpha: is ${depthAlpha}; give a number above 0, at most 0.99`;
    assert.throws(() => core.depthAlphaOf({ depthAlpha }), { name: "AvatarError", message });
  }
});
