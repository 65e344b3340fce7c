// Lights of three.js, Babylon.js and PlayCanvas on avatars: LIT=PACK node --test tests/lit/adapters.test.mjs.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { DISTANCE, SIZE, begin, difference, end, pictures } from "../adapters_page.mjs";
import { CHROMIUM } from "../browser.mjs";

const FOV_Y = 0.6, RADIUS = 0.08; // of harness/adapters/stage.js
const C0 = [0.28209479], C1 = [-0.48860251, 0.48860251, -0.48860251];
const SUN = { kind: "sun", towards: [2, 3, 4], colour: [1, 0.6, 0.3], intensity: 2.5, casts: true };
const BULB = { kind: "bulb", at: [-1.2, 0.4, 1.6], colour: [0.4, 0.7, 1], intensity: 4, range: 8 };
const EVEN = { kind: "ambient", colour: [0.2, 0.25, 0.3], intensity: 1 };
const SKY = { kind: "sky", colour: [0.3, 0.5, 0.8], ground: [0.3, 0.2, 0.1], intensity: 1 };
const SPOT = { kind: "spot", at: [0.6, 1.5, 1.5], angle: 0.5, colour: [1, 1, 0.5], intensity: 2, range: 8 };
const WEAK = { ...SUN, towards: [0, -1, 0], intensity: 0.01, casts: false };
const LEAST = 0.02; // linear: the ball has facets, which show where its light ends
const srgb = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
const power = (v) => v ** (1 / 2.2);

const ENGINES = [
  { stage: "three", display: srgb, more: [SKY], sun: 1, bulb: 1 },
  { stage: "babylon", display: srgb, more: [SKY], sun: 1, bulb: 1 },
  { stage: "playcanvas", display: power, more: [{ ...BULB, at: [1, -0.5, 1.4], linear: true }], sun: 1 / Math.PI, bulb: 1 / 32 }, // its lights are stronger
];
const APIS = ["webgl2", ...(CHROMIUM && process.env.ADAPTERS === "all" ? ["webgpu"] : [])];

before(begin);
after(end);

/** What the ball reflects where a pixel sees it, linear, in the light of an actor; null: another thing is seen. */
function reflected({ ambient, places, colours, count }, column, row) {
  const tan = Math.tan(FOV_Y / 2);
  const ray = [((2 * (column + 0.5)) / SIZE - 1) * tan, (1 - (2 * (row + 0.5)) / SIZE) * tan, -1];
  const a = ray.reduce((sum, v) => sum + v * v, 0), b = ray[2] * DISTANCE, c = DISTANCE ** 2 - RADIUS ** 2;
  const root = b * b - a * c;
  if (root < 0) return null;
  const t = (-b - Math.sqrt(root)) / a;
  const at = [ray[0] * t, ray[1] * t, DISTANCE + ray[2] * t];
  const [x, y, z] = at.map((v) => v / RADIUS);
  if (-x * ray[0] - y * ray[1] - z * ray[2] < 0.3) return null; // its edge, where pixels mix
  const bases = [C0[0], C1[0] * y, C1[1] * z, C1[2] * x];
  const found = [0, 1, 2].map((channel) => bases.reduce((sum, basis, k) => sum + basis * ambient[3 * k + channel], 0));
  for (let k = 0; k < count; k++) {
    const to = [0, 1, 2].map((i) => places[4 * k + i] - places[4 * k + 3] * at[i]);
    const distance = Math.hypot(...to);
    const facing = Math.max(0, (x * to[0] + y * to[1] + z * to[2]) / distance) / (places[4 * k + 3] === 1 ? distance ** 2 : 1);
    for (let channel = 0; channel < 3; channel++) found[channel] += facing * colours[3 * k + channel];
  }
  return found;
}

/** The largest difference of a picture of the ball from what it should reflect, in steps of 1/255. */
function off(picture, light, display) {
  let most = 0, seen = 0;
  for (let i = 0; i < SIZE * SIZE; i++) {
    const want = reflected(light, i % SIZE, Math.floor(i / SIZE));
    for (let channel = 0; want !== null && channel < 3; channel++) {
      if (want[channel] < LEAST) continue;
      seen++;
      most = Math.max(most, Math.abs(picture[4 * i + channel] - 255 * display(Math.min(1, want[channel]))));
    }
  }
  assert.ok(seen > 1000, "the ball is hardly seen");
  return most;
}

for (const { stage, display, more, sun, bulb } of ENGINES) {
  for (const api of APIS) {
    test(`${stage} ${api}: a white ball and an avatar get the same light`, { timeout: 240_000 }, async () => {
      const scaled = (lamp) => ({ ...lamp, intensity: lamp.intensity * ({ sun, bulb, spot: bulb }[lamp.kind] ?? 1) });
      const scenes = { sun: [SUN], bulb: [BULB, EVEN], all: [SUN, BULB, EVEN, SPOT, ...more], many: [WEAK, WEAK, WEAK, BULB, SUN, BULB] };
      const steps = [["wall", null], ["add", "/lit.avatar"], ["picture", "trained"], ["ball", true]];
      for (const [name, lamps] of Object.entries(scenes)) {
        steps.push(["lamps", lamps.map(scaled)], ["place", 0, 0, 0, 0, 0, 0.01], ["ball", true], ["picture", `${name}_ball`], ["lit", 0, `${name}_lit`]);
        steps.push(["place", 0, 0, 0, 0, 0.3, 1], ["ball", false], ["picture", name]);
      }
      steps.push(["lamps", []], ["place", 0, 0, 0, 0, 0, 1], ["picture", "dark"], ["lit", 0, "dark_lit"]);
      const seen = await pictures({ stage, api, shadows: true }, steps); // the mesh that casts is not seen
      const lit = Object.fromEntries(Object.keys(scenes).map((name) => [name, JSON.parse(seen[`${name}_lit`])]));
      for (const name of ["sun", "bulb"]) assert.ok(off(seen[`${name}_ball`], lit[name], display) <= 2, `${name}: ${off(seen[`${name}_ball`], lit[name], display)}`);
      assert.deepEqual([lit.sun.count, lit.sun.shadow, lit.bulb.shadow], [1, true, false]);
      // A spot light is the same at the middle alone, so the ball differs a little.
      assert.ok(off(seen.all_ball, lit.all, display) <= 12, `all: ${off(seen.all_ball, lit.all, display)}`);
      assert.equal(lit.many.count, 4);
      assert.ok(lit.many.shadow && lit.many.colours[0] > lit.many.colours[2], "the one that casts comes first");
      assert.equal(difference(seen.dark, seen.trained), 0);
      assert.equal(String(seen.dark_lit), "null");
      // WebGPURenderer blends in linear light.
      await asThePlayer(seen, lit, Object.keys(scenes), stage === "three" && api === "webgpu");
    });
  }
}

/** The pictures of an engine are those of the player in the same light. */
async function asThePlayer(seen, lit, names, linear) {
  const steps = [["add", "/lit.avatar"], ["place", 0, 0, 0, 0, 0.3, 1]];
  for (const name of names) {
    const { ambient, places, colours, count, shadow } = lit[name];
    const three = (values, k, width) => values.slice(width * k, width * k + 3);
    const lights = Array.from({ length: count }, (_, k) => ({ [places[4 * k + 3] === 1 ? "position" : "direction"]: three(places, k, 4), colour: three(colours, k, 3) }));
    steps.push(["light", 0, { ambient: Array.from({ length: 9 }, (_, k) => three(ambient, k, 3)), lights, shadow }], ["picture", name]);
  }
  const wanted = await pictures({ stage: "player", api: "webgl2", linear }, steps);
  for (const name of names) {
    assert.ok(difference(seen[name], seen.trained) > 30, `${name} changes nothing`);
    assert.ok(difference(seen[name], wanted[name]) <= 2, `${name}: ${difference(seen[name], wanted[name])}`);
  }
}

test("a left-handed scene is lit as a right-handed one", { timeout: 240_000 }, async () => {
  const lamps = [SUN, BULB, SKY];
  const mirrored = ([x, y, z]) => [-x, y, z];
  const other = lamps.map(({ at, towards, ...rest }) => ({ ...rest, ...(at && { at: mirrored(at) }), ...(towards && { towards: mirrored(towards) }) }));
  const shown = (all, leftHanded) => pictures({ stage: "babylon", api: "webgl2", leftHanded }, [["wall", null], ["add", "/lit.avatar"], ["lamps", all], ["picture", "lit"]]);
  const [right, left] = [await shown(lamps, false), await shown(other, true)];
  assert.ok(difference(right.lit, left.lit) <= 1, `${difference(right.lit, left.lit)}`);
});
