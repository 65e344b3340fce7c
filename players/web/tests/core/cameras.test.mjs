// Cameras as Python makes them, and as engines do.

import assert from "node:assert/strict";
import { test } from "node:test";
import { PerspectiveCamera, Vector3 } from "three";
import { core, json, largest, near, ROUNDING } from "./harness.mjs";

test("orbit and fromOpencv are those of Python", () => {
  const [camera, copy] = [new core.Camera(), new core.Camera()];
  const cases = json("cameras.json");
  assert.ok(cases.length >= 40);
  for (const { how, given, ...want } of cases) {
    camera[how](...given);
    for (const array of ["cameraFromWorld", "clipFromWorld", "centre", "tanHalfFov"]) {
      near(camera[array], want[array], 2 * ROUNDING * largest(want[array]), `${how} ${array}`);
    }
    assert.deepEqual([camera.width, camera.height], given.slice(-2));
    copy.copy(camera);
    assert.deepEqual(copy, camera);
  }
});

/** Pixels of the world point `p`, first row on top, pixel centres at integers: by three.js, and by our clip matrix. */
function seenByThree(three, p, width, height) {
  const ndc = new Vector3(...p).project(three);
  return [((ndc.x + 1) / 2) * width - 0.5, ((1 - ndc.y) / 2) * height - 0.5];
}
function seenByUs({ clipFromWorld, width, height }, p) {
  const [x, y, w] = [0, 1, 3].map((row) => [...p, 1].reduce((sum, value, i) => sum + clipFromWorld[4 * row + i] * value, 0));
  return [((x / w + 1) / 2) * width - 0.5, ((y / w + 1) / 2) * height - 0.5];
}

test("a camera of three.js sees the same pixels, and so does one of Babylon.js, which looks along +z", () => {
  for (const offset of [null, [1000, 700, 300, 100, 640, 480]]) {
    const three = new PerspectiveCamera(40, 640 / 480, 0.1, 50);
    three.position.set(0.5, 0.3, 2);
    three.lookAt(0.1, -0.2, 0.1);
    if (offset) three.setViewOffset(...offset);
    three.updateMatrixWorld();
    three.updateProjectionMatrix();
    const [view, projection] = [three.matrixWorldInverse.elements, three.projectionMatrix.elements];
    const [camera, other] = [new core.Camera(), new core.Camera()];
    camera.fromOpengl(view, projection, 640, 480);
    near(camera.centre, [0.5, 0.3, 2], 1e-6, "centre");
    for (const p of [[0, 0, 0], [0.3, -0.2, 0.5], [-0.4, 0.1, -1]]) {
      near(seenByUs(camera, p), seenByThree(three, p, 640, 480), 1e-3, `${p}`);
    }
    near(camera.tanHalfFov.slice(1), [Math.tan((20 * Math.PI) / 180) * (offset ? 480 / 700 : 1)], 1e-6, "tangent");
    const flippedView = view.map((value, i) => (i % 4 === 2 ? -value : value)); // its z points forward
    other.fromOpengl(flippedView, projection.map((value, i) => (i >> 2 === 2 ? -value : value)), 640, 480);
    assert.deepEqual(other, camera);
  }
});

test("what is no perspective camera is refused", () => {
  const camera = new core.Camera();
  const still = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  assert.throws(() => camera.fromOpengl(still, still, 64, 64), { name: "AvatarError", message: /orthographic/ });
  assert.throws(() => camera.orbit([0, 0, 0], 1, 0, 0, 1, 0, 64), { name: "AvatarError", message: /0x64/ });
});
