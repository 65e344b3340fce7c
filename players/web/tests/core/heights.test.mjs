// How tall avatars stand in images, and which levels serve: the vectors of all players.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bytes, core, json } from "./harness.mjs";

const { heights, sequences } = json("height_px.json");
const host = { changed() {}, remove() {} };
const instanceOf = async (name) => new core.Instance(await core.load(bytes(`${name}.avatar`)), host, 0);

for (const hand of ["right", "left"]) {
  test(`heights of a ${hand}-handed pack`, async () => {
    const instance = await instanceOf(`height_${hand}`);
    const camera = new core.Camera();
    for (const { name, clip_from_world, image_px, place, pose, height_px } of heights) {
      instance.place.set(place);
      // Arrays of a pose are in the frame of the pack.
      const sign = (i) => (hand === "left" && i < 4 !== (i % 4 === 0) ? -1 : 1);
      instance.pose.worldFromAvatar.set(pose.map((value, i) => sign(i) * value));
      camera.setMatrices(camera.cameraFromWorld, clip_from_world, [0, 0, 0], [1, 1], ...image_px);
      const found = instance.heightPx(camera);
      if (height_px === null) assert.equal(found, Infinity, name);
      else assert.ok(Math.abs(found / height_px - 1) < 1e-5, `${name}: ${found}, not ${height_px}`);
    }
  });
}

test("levels of sequences, those near a border stay", async () => {
  for (let i = 0; i < sequences.length; i++) {
    const { levels } = await core.load(bytes(`levels_${i}.avatar`));
    let level = sequences[i].shown;
    for (const [height, want] of sequences[i].steps) {
      level = core.nextLevel(levels, height ?? Infinity, level);
      assert.equal(level, want, `${sequences[i].name}, ${height}`);
    }
  }
});
