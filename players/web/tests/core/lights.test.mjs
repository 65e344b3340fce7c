// Lights in numbers, as Python's light_arrays has them; what is no light; lights that come and go.

import assert from "node:assert/strict";
import { test } from "node:test";
import { bytes, core, json, largest, near, ROUNDING } from "./harness.mjs";

const SUN = { ambient: [0.2, 0.3, 0.4], lights: [{ direction: [1, 2, 3], colour: [1, 0.9, 0.8] }], shadow: true };
const kernels = await core.kernelModule();
const lit = { right: await core.load(bytes("light_right.avatar")), left: await core.load(bytes("light_left.avatar")) };
const dark = await core.load(bytes("height_right.avatar"));

/** An instance, and `shown`: what is drawn of it, back to front. */
function staged(avatar) {
  const source = new core.QuadSource(new core.LocalPort(kernels));
  const instance = new core.Instance(avatar, source, 0);
  source.add(instance);
  const camera = new core.Camera();
  camera.orbit(avatar.framing.whole.target, 0.6, 0.2, 0.1, 0.7, 64, 64);
  const shown = () => {
    source.frame(camera);
    assert.ok(source.count > 0);
    return source.quads.slice(0, 12 * source.count);
  };
  return { instance, shown };
}

test("a light gives the numbers that it gives in Python, wherever the avatar stands", () => {
  const camera = new core.Camera();
  for (const { place, pose, head, ambient, lights, shadow, rows } of json("lights.json")) {
    const light = { ambient, shadow, lights: lights.map(([at, colour, point]) => ({ [point ? "position" : "direction"]: at, colour })) };
    for (const [hand, avatar] of Object.entries(lit)) {
      const { instance } = staged(avatar);
      instance.place.set(place);
      // Arrays of a pose are in the frame of the pack.
      instance.pose.worldFromAvatar.set(pose.map((value, i) => (hand === "left" && i < 4 !== (i % 4 === 0) ? -value : value)));
      instance.pose.setJoint(avatar.relight.joint, ...head);
      instance.light = light;
      instance.update(camera);
      const { floats, layout, lightAt } = instance.values;
      const wanted = rows[hand].flat();
      near(floats.subarray(lightAt, layout.lit), wanted, 4 * ROUNDING * largest(wanted), hand);
    }
  }
});

test("what is no light is named as Python names it, and the light stays", () => {
  const { instance } = staged(lit.right);
  instance.light = SUN;
  for (const [said, field, reason] of [...json("no_lights.json"), [{ lights: [{ direction: [1, NaN, 0], colour: [1, 1, 1] }] }, "lights[0].direction", "is not three numbers of at most 1e9"]]) {
    assert.throws(() => (instance.light = said), { name: "AvatarError", field: field ?? "light", reason }, JSON.stringify(said));
  }
  assert.equal(instance.light, SUN);
});

test("an avatar of an unknown light cannot be lit", () => {
  const { instance } = staged(dark);
  const reason = "its colours hold an unknown light; make it with `pack --relight`";
  assert.throws(() => (instance.light = {}), { name: "AvatarError", owner: dark.name, field: "light", reason });
  instance.light = null;
});

test("lights come and go, and leave no bit behind", () => {
  const { instance, shown } = staged(lit.right);
  const light = { lights: [{ direction: [1, 0.5, 0.2], colour: [1, 1, 1] }], shadow: true };
  /** What a new instance of the same pose shows. */
  const anew = (light) => {
    const other = staged(lit.right);
    other.instance.light = light;
    other.instance.pose.expressionWeights.set(instance.pose.expressionWeights);
    return other.shown();
  };
  const step = (light, weight, different) => {
    instance.light = light;
    instance.pose.expressionWeights.fill(weight);
    const found = shown();
    assert.deepEqual(found, anew(light));
    assert.notDeepEqual(found, different);
    return found;
  };
  const trained = shown();
  const first = step(light, 0, trained);
  const moved = step(light, 0.4, first); // the light stays
  const turned = step({ ...light, lights: [{ ...light.lights[0], direction: [-1, 0.5, 0.2] }] }, 0.4, moved); // the pose stays
  step({ ...light, shadow: false }, 0.4, turned);
  step(null, 0, first);
  step(light, 0.4, trained);
  assert.deepEqual(step(null, 0, first), trained);
});

test("a mesh that only casts shadows is posed for them, and for nothing else", () => {
  const avatar = lit.right;
  assert.ok(!avatar.program.readsMesh);
  const { instance } = staged(avatar);
  const scene = new core.KernelScene(new WebAssembly.Instance(kernels));
  const held = scene.add(1, core.kernelProgram(avatar, instance.program, true));
  scene.choose([1]);
  const camera = new core.Camera();
  const [at, bytes] = [held.address("Mesh") / 4, avatar.program.buffers.get("Mesh").bytes];
  const mesh = (weight, light) => {
    instance.pose.expressionWeights.fill(weight);
    instance.light = light;
    instance.update(camera);
    scene.run(Float32Array.of(...instance.poseFloats, ...instance.values.floats));
    return scene.heap.f32.slice(at, at + bytes / 4);
  };
  assert.ok(mesh(0, null).every((value) => value === 0) && mesh(0, { ...SUN, shadow: false }).every((value) => value === 0));
  const rest = mesh(0, SUN);
  const posed = mesh(0.5, SUN);
  assert.ok(rest.some((value) => value !== 0));
  assert.notDeepEqual(posed, rest);
  assert.deepEqual(mesh(0, null), posed);
  assert.deepEqual(mesh(0, SUN), rest);
});
