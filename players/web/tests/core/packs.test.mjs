// Packs load as Python reads them, bit for bit.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bytes, core, json, loaded, PACKS, sha } from "./harness.mjs";

for (const name of PACKS) {
  test(`${name} holds what Python reads`, async () => {
    const avatar = await loaded(name);
    const want = json(name, "facts.json");
    const buffers = [...avatar.program.buffers.values()];
    assert.deepEqual(
      Object.fromEntries(buffers.map((one) => [one.name, [one.bytes, sha(core.contentOf(one))]])),
      want.buffers,
    );
    assert.deepEqual(avatar.expressions.map((one) => [one.name, one.aliases, one.range]), want.expressions);
    assert.deepEqual(avatar.groups.map((one) => [one.name, one.first, one.count, one.binding]), want.groups);
    const arrays = ["expressionWeights", "lateWeights", "jointDelta", "worldFromAvatar"];
    const clips = avatar.clips.map((clip) => ({ name: clip.name, ...Object.fromEntries(arrays.map((one) => [one, sha(clip[one])])) }));
    assert.deepEqual(clips, want.clips);
    assert.deepEqual(avatar.skeleton && skeletonOf(avatar), want.skeleton);
    const { target, low, high } = want;
    assert.deepEqual([avatar.framing.whole.target, avatar.bounds.low, avatar.bounds.high], [target, low, high]);
    assert.equal(avatar.bytes, bytes(name, "pack.avatar").length);
  });
}

function skeletonOf({ skeleton, program }) {
  const unique = Uint32Array.from(new Set(skeleton.anchorVertices)).sort();
  const arrays = ["parents", "restLocal", "inverseBindMatrix", "jointBasis"].map((name) => [name, sha(skeleton[name])]);
  const anchors = { anchorVertices: [...skeleton.anchorVertices], anchors: sha(new core.Anchors(program, unique).rest) };
  return { names: skeleton.names, ...Object.fromEntries(arrays), ...anchors };
}

test("what a person needs is read", async () => {
  const avatar = await loaded("joints");
  assert.equal(avatar.name, "Full Ävatar");
  assert.equal(core.SHADERS, json("packs.json").shaders);
  assert.equal(avatar.handedness, "right");
  assert.equal((await loaded("left")).handedness, "left");
  assert.deepEqual(avatar.background, [0.25, 0.5, 1]);
  assert.deepEqual(avatar.levels, [{ count: 48, heightPx: null, psnrDb: null }]);
  assert.equal((await loaded("two_levels")).levels.length, 2);
  assert.equal((await loaded("surface_without_rig")).driving, null);
  assert.deepEqual(avatar.rules.rotation, "polar3");
  assert.ok(avatar.bounds.low[0] < avatar.bounds.high[0]);
});

test("bytes come as an array, a buffer, a blob or a file", async () => {
  const file = bytes("joints", "pack.avatar");
  for (const source of [file, file.slice().buffer, new Blob([file]), new File([file], "a.avatar")]) {
    assert.equal((await core.load(source)).expressions.length, 4);
  }
});
