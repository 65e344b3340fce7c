// Avatars in three.js, Babylon.js and PlayCanvas: node --test tests/adapters.test.mjs.
import assert from "node:assert/strict";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { play, playScene } from "./adapter_scenes.mjs";
import { launch } from "./browser.mjs";

const PACKS = join(dirname(fileURLToPath(import.meta.url)), "../../../tests/data/packs/1.0");
const MOLE = join(PACKS, "../../mole"); // a head with a mole on its left cheek, in both frames
const FILES = { "/first.avatar": join(PACKS, "joints.avatar"), "/second.avatar": join(PACKS, "surface.avatar") };
for (const hand of ["right", "left"]) FILES[`/${hand}.avatar`] = join(MOLE, `${hand}.avatar`);
const SIZE = 128;
const DISTANCE = 0.6; // of the camera
const WALL = [200, 90, 30];
const BACKGROUND = [40, 60, 120];

// Everything that an adapter does, once. A wall hides x < 0 of what is behind it.
const STEPS = [
  ["wall", null],
  ["add", "/first.avatar"],
  ["picture", "plain"],
  ["wall", 0.2],
  ["picture", "half"],
  ["wall", 0],
  ["picture", "cut"],
  ["wall", null],
  ["add", "/second.avatar"],
  ["place", 1, 0.03, 0, 0.1, 0, 1],
  ["picture", "nearer"],
  ["place", 1, 0.03, 0, -0.1, 0, 1],
  ["picture", "farther"],
  ["place", 1, -0.05, 0.04, -0.1, 0.7, 1.5],
  ["picture", "placed"],
  ["show", 0, false],
  ["picture", "hidden"],
  ["dispose", 1],
  ["show", 0, true],
  ["picture", "disposed"],
  ["dispose", 0],
  ["add", "/right.avatar"],
  ["picture", "right"],
  ["dispose", 2],
  ["add", "/left.avatar"],
  ["picture", "left"],
  ["disposeAvatars"],
  ["wall", 0],
  ["picture", "without"],
];
const COMPARED = ["plain", "nearer", "farther", "placed", "hidden", "disposed", "right", "left"];

// Options are spread over the engines; ADAPTERS=all adds the rest.
const ENGINES = [
  { stage: "three_webgl", api: "webgl2", antialias: true },
  { stage: "three_webgpu", api: "webgpu", linear: true },
  { stage: "babylon_webgl", api: "webgl2", target: true },
  { stage: "babylon_webgpu", api: "webgpu", target: true, antialias: true },
  { stage: "playcanvas_webgl", api: "webgl2", synchronous: true, antialias: true },
  { stage: "playcanvas_webgpu", api: "webgpu", antialias: true },
];
const REST = [
  { stage: "three_webgl", api: "webgl2", reversed: true },
  { stage: "three_webgpu", api: "webgpu", reversed: true, linear: true },
  { stage: "three_webgl", api: "webgl2", target: true, synchronous: true, linear: true },
  { stage: "three_webgpu", api: "webgpu", target: true, antialias: true, linear: true },
  { stage: "three_webgpu", api: "webgl2", target: true, linear: true }, // WebGPURenderer where there is no WebGPU
  { stage: "babylon_webgl", api: "webgl2", antialias: true, synchronous: true },
  { stage: "babylon_webgpu", api: "webgpu" },
  { stage: "playcanvas_webgl", api: "webgl2", target: true, antialias: true },
  { stage: "playcanvas_webgpu", api: "webgpu", target: true },
];
if (process.env.ADAPTERS === "all") ENGINES.push(...REST);
const OPTIONS = { distance: DISTANCE, antialias: false, target: false, synchronous: false, linear: false };

let browser;
const expected = {}; // pictures of the player, blended as displayed and in linear light

before(async () => {
  browser = await launch();
  for (const linear of [false, true]) {
    const { pictures, errors } = await playScene(browser, "player", { ...OPTIONS, api: "webgl2", linear }, FILES, STEPS.slice(0, -3));
    assert.deepEqual(errors, []);
    expected[linear] = pictures;
    sameForBothHands(pictures);
  }
});
after(() => browser?.close());

/** The largest difference of two pictures, in steps of 1/255; `inside(x)` chooses columns. */
function difference(a, b, inside = () => true) {
  let most = 0;
  for (let i = 0; i < 4 * SIZE * SIZE; i++) {
    if (i % 4 < 3 && inside((i >> 2) % SIZE)) most = Math.max(most, Math.abs(a[i] - b[i]));
  }
  return most;
}

/** Packs of both handednesses show the same, the mole on the image's right. */
function sameForBothHands(pictures) {
  assert.ok(difference(pictures.left, pictures.right) <= 1, `${difference(pictures.left, pictures.right)}`);
  let red = 0, column = 0;
  for (let i = 0; i < SIZE * SIZE; i++) {
    const weight = Math.max(0, pictures.left[4 * i] - Math.max(pictures.left[4 * i + 1], pictures.left[4 * i + 2]) - 40);
    red += weight;
    column += weight * (i % SIZE);
  }
  assert.ok(red > 200 && column / red > 0.6 * SIZE, `${red} ${column / red}`);
}

const left = (x) => x < SIZE / 2;
const right = (x) => x >= SIZE / 2;
const filled = (colour) => Uint8Array.from({ length: 4 * SIZE * SIZE }, (_, i) => colour[i % 4] ?? 255);

for (const engine of ENGINES) {
  const { stage, ...options } = engine;
  const name = [stage, ...Object.entries(options).map(([key, value]) => (value === true ? key : value))].join(" ");
  test(name, { timeout: 240_000 }, async () => {
    const { pictures: seen, errors } = await playScene(browser, stage, { ...OPTIONS, ...options }, FILES, STEPS);
    assert.deepEqual(errors, []);
    const wanted = expected[options.linear === true];
    for (const picture of COMPARED) {
      assert.ok(difference(seen[picture], wanted[picture]) <= 1, `${picture}: ${difference(seen[picture], wanted[picture])}`);
    }
    sameForBothHands(seen);
    for (const [one, other] of [["plain", "nearer"], ["nearer", "farther"], ["farther", "placed"], ["placed", "hidden"], ["hidden", "disposed"]]) {
      assert.ok(difference(seen[one], seen[other]) > 60, `${one} and ${other} are alike`);
    }
    assert.equal(difference(seen.half, filled(WALL), left), 0);
    assert.ok(difference(seen.half, seen.plain, right) <= 1);
    // A wall through the middle hides some of the splats, and those before it are seen against it.
    assert.ok(difference(seen.cut, filled(WALL), left) > 60);
    assert.ok(difference(seen.cut, seen.plain, right) <= 1);
    assert.equal(difference(seen.without, filled(WALL), left), 0);
    assert.equal(difference(seen.without, filled(BACKGROUND), right), 0);
  });
}

for (const stage of ["three_webgl", "babylon_webgl", "playcanvas_webgl"]) {
  test(`${stage}: a context that was lost, and a camera without perspective`, { timeout: 240_000 }, async () => {
    const steps = [...STEPS.slice(0, 3), ["lose"], ["picture", "restored"], ["orthographic", "refused"], ["picture", "again"]];
    const { pictures, errors } = await playScene(browser, stage, { ...OPTIONS, api: "webgl2" }, FILES, steps);
    assert.deepEqual(errors.filter((error) => !/context|CONTEXT_LOST/i.test(error)), []);
    assert.equal(pictures.refused.toString(), "AvatarError: the camera: has no perspective; an orthographic camera cannot show an avatar");
    for (const name of ["plain", "restored", "again"]) {
      assert.ok(difference(pictures[name], expected.false.plain) <= 1, `${name}: ${difference(pictures[name], expected.false.plain)}`);
    }
  });
}

test("a left-handed scene shows the avatar as a right-handed one does", { timeout: 240_000 }, async () => {
  const options = { ...OPTIONS, api: "webgl2", leftHanded: true };
  const hands = ["right", "left"].flatMap((hand, i) => [["dispose", i], ["add", `/${hand}.avatar`], ["picture", hand]]);
  const { pictures, errors } = await playScene(browser, "babylon_webgl", options, FILES, [...STEPS.slice(0, 3), ...hands]);
  assert.deepEqual(errors, []);
  assert.ok(difference(pictures.plain, expected.false.plain) <= 1);
  sameForBothHands(pictures);
});

/** Images that GlScene draws without an engine into black targets; near things hide the left half. */
async function drawn(...cases) {
  const all = cases.map((one) => ({ distance: DISTANCE, ...one }));
  const { result, errors } = await play(browser, "context", "player", FILES, "/first.avatar", all);
  assert.deepEqual(errors, []);
  return result.map((one, i) => {
    assert.deepEqual(one.changed, [], `state of the context that changed: ${JSON.stringify(cases[i])}`);
    assert.deepEqual(one.errors, []);
    return one.images;
  });
}

const black = filled([0, 0, 0]);

test("a WebGL2 context is left as it was, and what hides avatars hides them", { timeout: 240_000 }, async () => {
  const same = [{ reversed: true }, { clipControl: true }, { reversed: true, clipControl: true }];
  const cases = [{}, { noDepth: true }, { colours: 2 }, { noCopy: true }, ...same];
  const [[plain], [free], [first, second], [direct], ...others] = await drawn(...cases);
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
});

test("a viewport holds the picture of its own camera", { timeout: 240_000 }, async () => {
  const [x, y, width, height] = [40, 0, 64, 128];
  const [[whole], [part]] = await drawn({ noDepth: true }, { noDepth: true, part: [x, y, width, height] });
  const inside = (column) => column >= x && column < x + width;
  assert.equal(difference(part, black, (column) => !inside(column)), 0);
  // The narrower camera sees the middle columns of the whole picture.
  const moved = Uint8Array.from(whole, (_, i) => whole[i + 4 * ((SIZE - width) / 2 - x)] ?? 0);
  assert.ok(difference(part, moved, inside) <= 1, `${difference(part, moved, inside)}`);
});
