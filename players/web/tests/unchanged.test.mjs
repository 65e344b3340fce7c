// Passes whose inputs have not changed are left out; the image is the one of all passes: node --test.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { openHarness } from "./pages.mjs";

const SIZE = 48; // pixels
let harness;

before(async () => (harness = await openHarness("memory", ["joints"])));
after(() => harness?.close());

for (const backend of ["webgl2", "webgpu"]) {
  test(`${backend}: after a change of the camera, of the pose, and of nothing`, { timeout: 240_000 }, async () => {
    const { page, errors } = await harness.again();
    await page.evaluate((b) => window.start(b, "joints.avatar"), backend);
    const image = (ofPose, ofCamera) => page.evaluate((p, c, size) => window.image([[p, c]], size), ofPose, ofCamera, SIZE);
    const first = await image(1, 1); // nothing was run before
    assert.notEqual(await image(1, 0), first, "another camera gives another image");
    assert.equal(await image(1, 1), first, "camera");
    assert.notEqual(await image(0, 1), first, "another pose gives another image");
    assert.equal(await image(1, 1), first, "pose");
    assert.equal(await image(1, 1), first, "nothing");
    assert.deepEqual(errors, []);
    await page.close();
  });
}
