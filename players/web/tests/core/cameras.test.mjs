// Cameras as Python makes them, and as engines do.

import assert from "node:assert/strict";
import { test } from "node:test";
import { PerspectiveCamera, Vector3 } from "three";
import { core, json, largest, near, ROUNDING } from "./harness.mjs";

const ARRAYS = ["cameraFromWorld", "clipFromWorld", "centre", "tanHalfFov"];

test("orbit and fromOpencv are those of Python", () => {
  const camera = new core.Camera();
  const cases = json("cameras.json");
  assert.ok(cases.length >= 40);
  for (const { how, given, ...want } of cases) {
    camera[how](...given);
    for (const array of ARRAYS) {
      near(camera[array], want[array], 2 * ROUNDING * largest(want[array]), `${how} ${array}`);
    }
    assert.deepEqual([camera.width, camera.height], given.slice(-2));
  }
});

test("set takes a centred camera", () => {
  const camera = new core.Camera();
  const other = new core.Camera();
  camera.orbit([0.1, 0.2, 0.3], 2, 0.4, 0.5, 0.6, 640, 480);
  other.set(camera.cameraFromWorld, camera.tanHalfFov[0], camera.tanHalfFov[1], 640, 480);
  for (const array of ARRAYS) {
    near(other[array], camera[array], 4 * ROUNDING * largest(camera[array]), array);
  }
  other.orbit([0, 0, 0], 1, 0, 0, 1, 1, 1);
  other.copy(camera);
  assert.deepEqual(other, camera);
});

/** What three.js sees of the world point `p`: pixels, first row on top, pixel centres at integers. */
function seenByThree(three, p, width, height) {
  const ndc = new Vector3(...p).project(three);
  return [((ndc.x + 1) / 2) * width - 0.5, ((1 - ndc.y) / 2) * height - 0.5];
}

/** The same by our clip matrix. */
function seenByUs(camera, p) {
  const clip = [0, 1, 3].map((row) => [0, 1, 2, 3].reduce((sum, i) => sum + camera.clipFromWorld[4 * row + i] * (p[i] ?? 1), 0));
  return [((clip[0] / clip[2] + 1) / 2) * camera.width - 0.5, ((clip[1] / clip[2] + 1) / 2) * camera.height - 0.5];
}

test("a camera of three.js sees the same pixels, off-centre ones too", () => {
  const camera = new core.Camera();
  for (const offset of [null, [1000, 700, 300, 100, 640, 480]]) {
    const three = new PerspectiveCamera(40, 640 / 480, 0.1, 50);
    three.position.set(0.5, 0.3, 2);
    three.lookAt(0.1, -0.2, 0.1);
    if (offset) three.setViewOffset(...offset);
    three.updateMatrixWorld();
    three.updateProjectionMatrix();
    camera.setFrom(three.matrixWorldInverse.elements, three.projectionMatrix.elements, 640, 480);
    near(camera.centre, [0.5, 0.3, 2], 1e-6, "centre");
    for (const p of [[0, 0, 0], [0.3, -0.2, 0.5], [-0.4, 0.1, -1]]) {
      near(seenByUs(camera, p), seenByThree(three, p, 640, 480), 1e-3, `${p}`);
    }
    assert.ok(Math.abs(camera.tanHalfFov[1] - Math.tan((20 * Math.PI) / 180) * (offset ? 480 / 700 : 1)) < 1e-6);
  }
});

test("orbit and a camera of three.js at the same place agree", () => {
  const three = new PerspectiveCamera(30, 2, 0.1, 50);
  three.position.set(Math.sin(0.3) * 2, 0, Math.cos(0.3) * 2);
  three.lookAt(0, 0, 0);
  three.updateMatrixWorld();
  const camera = new core.Camera();
  const orbit = new core.Camera();
  camera.setFrom(three.matrixWorldInverse.elements, three.projectionMatrix.elements, 200, 100);
  orbit.orbit([0, 0, 0], 2, 0.3, 0, Math.PI / 6, 200, 100);
  for (const array of ARRAYS) {
    near(camera[array], orbit[array], 1e-6 * largest(orbit[array]), array);
  }
});

test("a camera that looks along +z, as those of Babylon.js, sees a mirrored world the same way", () => {
  const three = new PerspectiveCamera(35, 1.5, 0.1, 50);
  three.position.set(0.5, 0.3, 2);
  three.lookAt(0.1, -0.2, 0.1);
  three.updateMatrixWorld();
  const view = Float64Array.from(three.matrixWorldInverse.elements);
  const projection = Float64Array.from(three.projectionMatrix.elements);
  for (let column = 0; column < 4; column++) view[4 * column + 2] *= -1; // its z points forward
  for (let row = 0; row < 4; row++) projection[8 + row] *= -1;
  const camera = new core.Camera();
  const same = new core.Camera();
  camera.setFrom(view, projection, 300, 200);
  same.setFrom(three.matrixWorldInverse.elements, three.projectionMatrix.elements, 300, 200);
  assert.deepEqual(camera, same);
});

test("what is no perspective camera is refused", () => {
  const camera = new core.Camera();
  const still = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
  assert.throws(() => camera.setFrom(still, still, 64, 64), { name: "AvatarError", message: /orthographic/ });
  assert.throws(() => camera.orbit([0, 0, 0], 1, 0, 0, 1, 0, 64), { name: "AvatarError", message: /0x64/ });
});
