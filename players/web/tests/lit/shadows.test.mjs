// Avatars cast shadows in three.js, Babylon.js and PlayCanvas: CASTS=FILE node --test tests/lit/shadows.test.mjs.
//
// CASTS: packs, each {file, path, pose, triangles [F, 3], rest and posed [V, 3]} with the mesh as Python's NumPy stages pose it.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { after, before, test } from "node:test";
import { DISTANCE, SIZE, begin, end, pictures } from "../adapters_page.mjs";
import { CHROMIUM } from "../browser.mjs";

const FOV_Y = 0.6; // of harness/adapters/stage.js
const FLOOR = -1; // z
const PLACE = [0.15, 0.75, -0.55, 0.4, 1.1]; // x, y, z, yaw, scale: above what the camera sees
const SUN = { kind: "sun", towards: [0.5, 2.4, 1.6], colour: [1, 1, 1], intensity: 2, casts: true };
const LEAST = 0.9; // intersection over union
const casts = JSON.parse(readFileSync(process.env.CASTS));

before(begin);
after(end);

/** Pixels [SIZE, SIZE] of the floor where a mesh of vertices [V, 3] that an avatar's place moves is before a sun. */
function shadowOf({ vertices, triangles }, [x, y, z, yaw, scale], { towards }) {
  const c = scale * Math.cos(yaw), s = scale * Math.sin(yaw);
  const perMetre = SIZE / 2 / (Math.tan(FOV_Y / 2) * (DISTANCE - FLOOR));
  const at = vertices.map(([a, b, d]) => {
    const point = [c * a + s * d + x, scale * b + y, c * d - s * a + z];
    const far = (FLOOR - point[2]) / towards[2];
    return [SIZE / 2 + perMetre * (point[0] + far * towards[0]), SIZE / 2 - perMetre * (point[1] + far * towards[1])];
  });
  const found = new Uint8Array(SIZE * SIZE);
  for (const corners of triangles) fill(found, corners.map((vertex) => at[vertex]));
  return found;
}

/** Sets the pixels whose centres a triangle covers. */
function fill(found, corners) {
  const [low, high] = [Math.min, Math.max].map((of) => [0, 1].map((i) => of(...corners.map((corner) => corner[i]))));
  const side = ([ax, ay], [bx, by], px, py) => (bx - ax) * (py - ay) - (by - ay) * (px - ax);
  for (let row = Math.max(0, Math.floor(low[1])); row <= Math.min(SIZE - 1, high[1]); row++) {
    for (let column = Math.max(0, Math.floor(low[0])); column <= Math.min(SIZE - 1, high[0]); column++) {
      const sides = corners.map((corner, i) => side(corner, corners[(i + 1) % 3], column + 0.5, row + 0.5));
      if (sides.every((one) => one >= 0) || sides.every((one) => one <= 0)) found[SIZE * row + column] = 1;
    }
  }
}

/** Pixels of a picture of the floor that are less than half as bright as the brightest. */
function darkOf(picture) {
  const green = Array.from({ length: SIZE * SIZE }, (_, i) => picture[4 * i + 1]);
  const most = Math.max(...green);
  assert.ok(most > 100, `the floor is dark: ${most}`);
  return Uint8Array.from(green, (value) => (value < most / 2 ? 1 : 0));
}

const count = (pixels) => pixels.reduce((sum, one) => sum + one, 0);

function overlap(a, b) {
  return count(a.map((one, i) => one & b[i])) / count(a.map((one, i) => one | b[i]));
}

const ALL = process.env.ADAPTERS === "all";
const ENGINES = [
  { stage: "three", api: "webgl2" },
  { stage: "babylon", api: "webgl2", leftHanded: true },
  { stage: "playcanvas", api: "webgl2" },
  ...(ALL ? [{ stage: "babylon", api: "webgl2" }, { stage: "three", api: "webgl2", fallback: true, target: true }] : []),
  ...(ALL && CHROMIUM ? ["three", "babylon", "playcanvas"].map((stage) => ({ stage, api: "webgpu" })) : []),
];
const mirrored = ([x, ...rest]) => [-x, ...rest];

/** Steps, and the shadow that is wanted in each picture; null: none. `at`: [x, y, z, yaw, scale] of an avatar. */
function scenes({ stage }, at, sun) {
  const wanted = {};
  const seen = (name, mesh, how = "glance") => {
    wanted[name] = mesh && shadowOf(mesh, PLACE, SUN);
    return [how, name];
  };
  const [first, second] = casts.map(({ triangles, rest, posed }) => ({ rest: { vertices: rest, triangles }, posed: { vertices: posed, triangles } }));
  const steps = [["wall", null], ["add", casts[0].file], ["place", 0, ...at], ["lamps", [sun]], ["floor", FLOOR]];
  steps.push(seen("rest", first.rest, "picture"), ["pose", 0, casts[0].pose], seen("posed", first.posed));
  steps.push(["show", 0, false], seen("hidden", null), ["show", 0, true], ["attach", 0, false], seen("away", null), ["attach", 0, true]);
  if (stage === "three") steps.push(["clone", 0], ["dispose", 0], seen("clone", first.posed), ["dispose", 1]);
  else steps.push(seen("back", first.posed), ["dispose", 0]);
  const last = stage === "three" ? 2 : 1;
  steps.push(["add", casts[1].file], ["place", last, ...at], ["lamps", [sun]], ["pose", last, casts[1].pose], seen("other", second.posed, "picture"));
  steps.push(["dispose", last], seen("freed", null));
  return { steps, wanted };
}

for (const engine of ENGINES) {
  test(`${Object.entries(engine).map(([key, value]) => (value === true ? key : value)).join(" ")}: the shadows of avatars on a floor are those of their meshes`, { timeout: 240_000 }, async (t) => {
    const hand = engine.leftHanded ? mirrored : (values) => values;
    const [x, y, z, yaw, scale] = PLACE;
    const { steps, wanted } = scenes(engine, [...hand([x, y, z]), engine.leftHanded ? -yaw : yaw, scale], { ...SUN, towards: hand(SUN.towards) });
    const seen = await pictures({ ...engine, shadows: true }, steps);
    for (const [name, want] of Object.entries(wanted)) {
      const dark = darkOf(seen[name]);
      if (want === null) {
        assert.equal(count(dark), 0, name);
        continue;
      }
      assert.ok(count(want) > 1000, `${name}: a small shadow`);
      t.diagnostic(`${name}: ${overlap(dark, want).toFixed(3)}`);
      assert.ok(overlap(dark, want) >= LEAST, `${name}: ${overlap(dark, want)}`);
    }
  });
}
