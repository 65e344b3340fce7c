// The light of the viewer page, moved as a person moves it: LIT=PACK node --test tests/lit/viewer.test.mjs.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { notHere } from "../browser.mjs";
import { begin, changes, drag, end, enter, errors, middle, opened, page, picture, settled, slider, valueOf, viewer } from "../viewer_page.mjs";

const AXE = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const check = (name, run, skip = false) => test(name, { timeout: 240_000, skip }, run);
const choose = (name) => page.select("#light", name);
const pressed = () => page.$eval("#light-button", (button) => button.getAttribute("aria-pressed") === "true");
const light = () => viewer(({ instance }) => instance.light);

before(begin);
after(end);

check("presets are those of the commands, and the picture as trained comes back", async () => {
  const presets = JSON.parse(await readFile(new URL("../../../../exporter/avatar_export/light_presets.json", import.meta.url)));
  await opened("lit", { width: 900, height: 300 });
  const trained = await picture();
  assert.equal(await light(), null);
  for (const [name, { lights }] of Object.entries(presets)) {
    await changes(() => choose(name));
    const found = await light();
    found.lights.forEach(({ direction, colour }, k) => {
      assert.deepEqual(colour, lights[k].colour);
      const length = Math.hypot(...lights[k].direction);
      direction.forEach((part, i) => assert.ok(Math.abs(part - lights[k].direction[i] / length) < 1e-9, name));
    });
  }
  await choose("As trained");
  assert.deepEqual(await picture(), trained);
});

check("sliders and drags move the light, and drags do not move the camera meanwhile", async () => {
  await choose("studio");
  await changes(() => enter(slider("Light, around"), "60"));
  const [x, y] = await middle();
  const eye = () => viewer(({ instance }) => [...instance.values.floats.subarray(instance.values.layout.first.eye, instance.values.layout.first.eye + 3)]);
  const stood = await eye();
  await page.keyboard.press("d");
  assert.ok(await pressed());
  await changes(() => drag([x, y], [x + 30, y - 20]));
  assert.ok((await valueOf("Light, around")) > 60 && (await valueOf("Light, height")) > 33);
  assert.deepEqual(await eye(), stood);
  const sun = await page.$eval("#sun", (element) => element.checkVisibility());
  await page.keyboard.press("d");
  assert.ok(sun && !(await page.$eval("#sun", (element) => element.checkVisibility())));
  const before = await light();
  await changes(() => drag([x, y], [x + 30, y]));
  assert.deepEqual(await light(), before);
});

check("a finger moves the light", async () => {
  await page.click("#light-button");
  const [x, y] = await middle();
  const [before] = (await light()).lights;
  await page.touchscreen.touchStart(x, y);
  await page.touchscreen.touchMove(x - 30, y);
  await page.touchscreen.touchEnd();
  await settled();
  assert.notDeepEqual((await light()).lights[0], before);
}, notHere);

check("everybody can work it, also where the avatar is presented", async () => {
  for (const presenting of [false, true]) {
    if (presenting) await page.click("#inspect-button");
    await page.evaluate(AXE);
    const found = await page.evaluate(async () => (await window.axe.run(document)).violations.map(({ id, nodes }) => `${id}: ${nodes[0].html}`));
    assert.deepEqual(found, []);
    assert.ok(await page.$eval("#light-button", (button) => button.checkVisibility()));
  }
}, notHere);

check("an avatar of an unknown light offers none", async () => {
  await opened("joints");
  assert.deepEqual(await page.$$eval("#lights, #light-button", (all) => all.filter((one) => one.checkVisibility())), []);
  await page.keyboard.press("t");
  assert.equal(await light(), null);
  assert.deepEqual(errors, []);
});
