// The meshes that cast shadows: who has one, when it is posed, what it leaves behind.

import assert from "node:assert/strict";
import { test } from "node:test";
import { core, loaded, PACKS } from "./harness.mjs";

const rigs = await core.Rigs.create();

test("an avatar with a mesh has one, which is posed when the pose has changed", async () => {
  for (const name of PACKS) {
    const avatar = await loaded(name);
    const pose = new core.Pose(avatar);
    assert.equal(rigs.add({ ...avatar, program: { ...avatar.program, mesh: [] } }), null);
    const rig = rigs.add(avatar);
    assert.ok(rig.update(pose, false) && !rig.update(pose, false), name);
    const still = rig.positions.slice();
    pose.worldFromAvatar[3] += 2;
    assert.ok(rig.update(pose, false), name);
    pose.worldFromAvatar[3] -= 2;
    if (avatar.expressions.length > 0) pose.expressionWeights.fill(0.5);
    rig.update(pose, false);
    rig.update((pose.reset(), pose), false);
    assert.deepEqual(rig.positions, still, name);
    rig.update(pose, true);
    assert.deepEqual(rig.positions, still.map((value, i) => (i % 3 === 0 ? -value : value)), name);
    rig.positions.forEach((value, i) => assert.ok(value >= rig.low[i % 3] && value <= rig.high[i % 3], name));
    rig.dispose();
    assert.ok(!rig.update(pose, false) && rigs.scene.heap.bytesUsed < 256, name); // lists that hold nothing
  }
});
