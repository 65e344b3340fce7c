// Avatars in three.js, Babylon.js and PlayCanvas: node --test tests/adapters.test.mjs.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { BACKGROUND, DISTANCE, PART, SIZE, WALL, begin, difference, end, pictures, play } from "./adapters_page.mjs";
import { CHROMIUM } from "./browser.mjs";

// Panes are drawn later than avatars, at these z.
const PANES = { behind: -0.3, through: 0, before: 0.3 };
const ALPHA = 0.5; // from which on splats hide panes
const MARGIN = 1e-3; // of alpha, and of metres: on either side
// Everything that an adapter does, once. A wall hides x < 0 of what is behind it.
const FIRST = [["wall", null], ["add", "/first.avatar"], ["picture", "plain"]];
const STEPS = [
  ...FIRST,
  ...Object.entries(PANES).flatMap(([name, z]) => [["pane", z], ["picture", name]]),
  ["pane", null],
  ["part", ...PART],
  ["picture", "part"],
  ["part", 0, 0, SIZE],
  ["wall", 0.2],
  ["picture", "half"],
  ["wall", 0],
  ["picture", "cut"],
  ["wall", null],
  ["add", "/second.avatar"],
  ["place", 1, 0.03, 0, 0.1, 0, 1],
  ["picture", "nearer"],
  ["attach", 1, false],
  ["picture", "removed"],
  ["attach", 1, true],
  ["picture", "attached"],
  ["place", 1, 0, 0, 0, 0, 0],
  ["picture", "flat"],
  ["place", 1, 0.03, 0, -0.1, 0, 1],
  ["picture", "farther"],
  ["place", 1, -0.05, 0.04, -0.1, 0.7, 1.5],
  ["seen", 1, "seen"],
  ["picture", "placed"],
  ["show", 0, false],
  ["picture", "hidden"],
  ["dispose", 1],
  ["show", 0, true],
  ["picture", "disposed"],
  ["dispose", 0],
  ["add", "/right.avatar"],
  ["seen", 2, "level"],
  ["picture", "right"],
  ["dispose", 2],
  ["add", "/left.avatar", 1],
  ["picture", "coarse"],
  ["dispose", 3],
  ["add", "/left.avatar"],
  ["picture", "left"],
  ["announced", "announced"],
  ["addLevel", 9, "nine"],
  ["disposeAvatars"],
  ["addLevel", 0, "afterwards"],
  ["wall", 0],
  ["picture", "without"],
];
const OF_PLAYER = [
  ...FIRST,
  ...Object.entries(PANES).flatMap(([name, z]) => [-1, 1].map((side) => ["dense", z + side * MARGIN, `${name}${side}`])),
  ...STEPS.slice(FIRST.length + 2 * Object.keys(PANES).length + 1, -6),
];
const SAME = [["plain", "removed", "flat", "disposed"], ["nearer", "attached"]];
const OTHERS = [["plain", "nearer"], ["nearer", "farther"], ["farther", "placed"], ["placed", "hidden"], ["hidden", "disposed"]];

// Options are spread over the engines; ADAPTERS=all adds the rest.
const ENGINES = [
  { stage: "three", api: "webgl2", antialias: true, shadows: true, reversed: true, depthAlpha: ALPHA },
  { stage: "three", api: "webgpu", linear: true, depthAlpha: ALPHA },
  { stage: "babylon", api: "webgl2", target: true, shadows: true, depthAlpha: ALPHA },
  { stage: "babylon", api: "webgpu", target: true, antialias: true, depthAlpha: ALPHA },
  { stage: "playcanvas", api: "webgl2", synchronous: true, antialias: true, depthAlpha: ALPHA },
  { stage: "playcanvas", api: "webgpu", antialias: true, shadows: true, depthAlpha: ALPHA },
];
const REST = [
  { stage: "three", api: "webgl2", depthAlpha: ALPHA },
  { stage: "three", api: "webgpu", reversed: true, linear: true, depthAlpha: ALPHA },
  { stage: "three", api: "webgl2", target: true, synchronous: true, linear: true },
  { stage: "three", api: "webgpu", target: true, antialias: true, linear: true },
  { stage: "three", api: "webgl2", fallback: true, target: true, linear: true }, // WebGPURenderer where there is no WebGPU
  { stage: "babylon", api: "webgl2", antialias: true, synchronous: true },
  { stage: "babylon", api: "webgpu" },
  { stage: "playcanvas", api: "webgl2", target: true, antialias: true },
  { stage: "playcanvas", api: "webgpu", target: true },
];
if (process.env.ADAPTERS === "all") ENGINES.push(...REST);
const asked = ENGINES.filter(({ api }) => CHROMIUM || api !== "webgpu");


const expected = {}; // what the player shows, blended as displayed and in linear light

before(async () => {
  await begin();
  for (const linear of [false, true]) {
    expected[linear] = await pictures({ stage: "player", api: "webgl2", linear }, OF_PLAYER);
    sameForBothHands(expected[linear]);
  }
});
after(end);

function near(a, b, what, inside) {
  assert.ok(difference(a, b, inside) <= 1, `${what}: ${difference(a, b, inside)}`);
}

/** Packs of both handednesses show the same, the mole on the image's right. */
function sameForBothHands(seen) {
  near(seen.left, seen.right, "left and right");
  let red = 0, column = 0;
  for (let i = 0; i < SIZE * SIZE; i++) {
    const weight = Math.max(0, seen.left[4 * i] - Math.max(seen.left[4 * i + 1], seen.left[4 * i + 2]) - 40);
    red += weight;
    column += weight * (i % SIZE);
  }
  assert.ok(red > 200 && column / red > 0.6 * SIZE, `${red} ${column / red}`);
}

/** The part of a picture that a viewport of PART shows, from a column and a row on; the rest is black. */
function cropped(picture, x, y) {
  return Uint8Array.from({ length: 4 * SIZE * SIZE }, (_, i) => {
    const [column, row] = [(i >> 2) % SIZE, Math.floor((i >> 2) / SIZE)];
    return column < PART[2] && row < PART[2] ? picture[4 * (SIZE * (row + y) + column + x) + (i % 4)] : 0;
  });
}

/** A pane is seen where no splat that is dense enough lies before it. `expected`: what `dense` posted of the player. */
function checkPanes(seen, expected, depthAlpha = Infinity) {
  for (const name of Object.keys(PANES)) {
    const [nearer, farther] = [1, -1].map((side) => JSON.parse(expected[`${name}${side}`]));
    const counts = { hidden: 0, shown: 0 };
    for (let i = 0; i < SIZE * SIZE; i++) {
      const hidden = nearer[i] >= depthAlpha + MARGIN;
      if (!hidden && farther[i] >= depthAlpha - MARGIN) continue;
      counts[hidden ? "hidden" : "shown"]++;
      const want = hidden ? seen.plain.subarray(4 * i, 4 * i + 3) : WALL;
      const off = Math.max(...[0, 1, 2].map((k) => Math.abs(seen[name][4 * i + k] - want[k])));
      assert.ok(off <= 1, `${name}: pixel ${i % SIZE}, ${Math.floor(i / SIZE)} should be ${hidden ? "hidden" : "shown"}: ${off}`);
    }
    assert.ok(counts.shown > 1000 && counts.hidden > 200 === (name !== "before" && depthAlpha < 1), `${name}: ${JSON.stringify(counts)}`);
  }
}

const left = (x) => x < SIZE / 2;
const right = (x) => x >= SIZE / 2;
const filled = (colour) => Uint8Array.from({ length: 4 * SIZE * SIZE }, (_, i) => colour[i % 4] ?? 255);

for (const engine of asked) {
  test(Object.entries(engine).map(([key, value]) => (value === true ? key : value)).join(" "), { timeout: 240_000 }, async () => {
    const seen = await pictures(engine, STEPS);
    const wanted = expected[engine.linear === true];
    for (const picture of Object.keys(wanted).filter((name) => wanted[name].length === seen.plain.length)) {
      if (!["half", "cut", "part"].includes(picture)) near(seen[picture], wanted[picture], picture);
    }
    // A viewport holds the middle of the whole picture.
    near(cropped(seen.part, PART[0], SIZE - PART[1] - PART[2]), cropped(wanted.plain, (SIZE - PART[2]) / 2, (SIZE - PART[2]) / 2), "part");
    checkPanes(seen, expected.false, engine.depthAlpha);
    sameForBothHands(seen);
    for (const [one, ...others] of SAME) for (const other of others) near(seen[one], seen[other], `${one} and ${other}`);
    for (const [one, other] of OTHERS) assert.ok(difference(seen[one], seen[other]) > 60, `${one} and ${other} are alike`);
    for (const name of ["seen", "level"]) {
      const [[height, level], want] = [JSON.parse(seen[name]), JSON.parse(wanted[name])];
      assert.ok(Math.abs(height / want[0] - 1) < 1e-5 && level === want[1], `${name}: ${seen[name]}, not ${wanted[name]}`);
    }
    // Where a worker computes, the engine's event says that there is a newer picture.
    assert.equal(String(seen.announced), String(engine.api === "webgl2" && engine.synchronous !== true));
    assert.equal(String(seen.nine), "AvatarError: mole: level: there is no level 9; the last one is level 1");
    assert.equal(String(seen.afterwards), "AvatarError: AvatarScene: was disposed; create another");
    assert.equal(difference(seen.half, filled(WALL), left), 0);
    near(seen.half, seen.plain, "half", right);
    // A wall through the middle hides some of the splats, and those before it are seen against it.
    assert.ok(difference(seen.cut, filled(WALL), left) > 60);
    near(seen.cut, seen.plain, "cut", right);
    assert.equal(difference(seen.without, filled(WALL), left), 0);
    assert.equal(difference(seen.without, filled(BACKGROUND), right), 0);
  });
}

for (const stage of ["three", "babylon", "playcanvas"]) {
  test(`${stage}: a context that was lost, and a camera without perspective`, { timeout: 240_000 }, async () => {
    const panes = [["pane", PANES.behind], ["picture", "behind"], ["pane", null]];
    const steps = [...FIRST, ...panes, ["lose"], ["picture", "restored"], ["orthographic", "refused"], ["picture", "again"]];
    const seen = await pictures({ stage, api: "webgl2" }, steps);
    assert.equal(difference(seen.behind, filled(WALL)), 0, "depth was written without being asked for");
    assert.equal(String(seen.refused), "AvatarError: the camera: has no perspective; an orthographic camera cannot show an avatar");
    for (const name of ["plain", "restored", "again"]) near(seen[name], expected.false.plain, name);
  });
}

test("a clone in three.js shows the avatar where it stood", { timeout: 240_000 }, async () => {
  const moved = FIRST.concat([["place", 0, 0.02, 0, -0.1, 0.5, 1.2], ["picture", "moved"]]);
  const seen = await pictures({ stage: "three", api: "webgl2" }, [...moved, ["clone", 0], ["dispose", 0], ["picture", "clone"]]);
  assert.ok(difference(seen.plain, seen.moved) > 60);
  assert.equal(difference(seen.clone, seen.moved), 0);
});

test("a left-handed scene shows the avatar as a right-handed one does", { timeout: 240_000 }, async () => {
  const hands = ["right", "left"].flatMap((hand, i) => [["dispose", i], ["add", `/${hand}.avatar`], ["picture", hand]]);
  const seen = await pictures({ stage: "babylon", api: "webgl2", leftHanded: true }, [...FIRST, ...hands]);
  near(seen.plain, expected.false.plain, "plain");
  sameForBothHands(seen);
});

/** Images that GlScene draws without an engine into black targets; near things hide the left half. */
async function drawn(...cases) {
  const [result, , errors] = await play("context", "player", "/first.avatar", cases.map((one) => ({ distance: DISTANCE, ...one })));
  assert.deepEqual(errors, []);
  return result.map((one, i) => {
    assert.deepEqual([one.changed, one.errors], [[], []], `state of the context that changed: ${JSON.stringify(cases[i])}`);
    return one.images;
  });
}

const black = filled([0, 0, 0]);
const flippedRows = (values) => values.map((_, i) => values[i + SIZE * (SIZE - 1 - 2 * Math.floor(i / SIZE))]);

test("a WebGL2 context is left as it was, and what hides avatars hides them", { timeout: 240_000 }, async () => {
  const same = [{ reversed: true }, { clipControl: true }, { reversed: true, clipControl: true }];
  const again = { depthAlpha: ALPHA, farther: 0.3 };
  const cases = [{}, { noDepth: true, depthAlpha: ALPHA }, { colours: 2, depthAlpha: ALPHA }, { noCopy: true, ...again }, ...same.map((one) => ({ ...one, ...again }))];
  const [[plain], [free], [first, second], [direct, ...more], ...others] = await drawn(...cases);
  assert.equal(difference(plain, black, left), 0);
  assert.ok(difference(plain, black, right) > 60);
  assert.ok(difference(free, black, left) > 60);
  assert.equal(difference(free, plain, right), 0);
  assert.equal(difference(first, plain), 0);
  assert.equal(difference(second, black), 0);
  // Where depth cannot be copied, each splat is rounded to bytes.
  assert.equal(difference(direct, black, left), 0);
  assert.ok(difference(direct, plain) <= 8, `${difference(direct, plain)}`);
  others.forEach(([image], i) => assert.equal(difference(image, plain), 0, JSON.stringify(same[i])));
  // What is drawn later does not show where depth was written.
  const dense = flippedRows(JSON.parse(expected.false.behind1).map((alpha) => alpha > ALPHA + MARGIN));
  for (const [before, later] of [[direct, more[0]], ...others]) {
    const off = (wanted) => Math.max(...dense.map((one, i) => (one === wanted ? Math.abs(before[4 * i] - later[4 * i]) : 0)));
    assert.ok(off(true) === 0 && off(false) > 30, `${off(true)} ${off(false)}`);
  }
});
