// The light of the element: LIT=PACK node --test tests/lit/element.test.mjs.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { check, page } from "../element_page.mjs";

const { left } = JSON.parse(await readFile(new URL("../../../../exporter/avatar_export/light_presets.json", import.meta.url)));

check("its attribute lights it at any time, by name, JSON or address", async () => {
  const seen = await page.evaluate(async (left) => {
    const element = await window.shown({ src: "lit.avatar", idle: "off", light: "studio" });
    const pictures = [];
    const add = async (light) => {
      element.light = light;
      await window.wait(50); // what it asks for comes later
      await window.rests(element);
      pictures.push(window.picture(element).place);
    };
    for (const light of ["studio", null, "left", JSON.stringify(left), `data:application/json,${JSON.stringify(left)}`]) await add(light);
    const trained = await window.shown({ src: "lit.avatar", idle: "off" });
    await window.rests(trained);
    return { pictures, trained: window.picture(trained).place, errors: element.events.filter(({ name }) => name === "error") };
  }, left);
  const [studio, none, byName, json, address] = seen.pictures;
  assert.equal(none, seen.trained);
  assert.equal(new Set([studio, none, byName]).size, 3);
  assert.deepEqual([json, address], [byName, byName]);
  assert.deepEqual(seen.errors, []);
});

check("what is no light, and an avatar that cannot have one, are named; it is shown as trained", async () => {
  const told = (attributes) => page.evaluate(async (given) => {
    const element = await window.shown({ idle: "off", ...given });
    return element.events.flatMap(({ name, text }) => (name === "error" ? [text] : []));
  }, attributes);
  const src = "lit.avatar";
  assert.deepEqual(await told({ src, light: '{"lights": [{"direction": [0, 1, NaN]}]}' }), ["light: is none of studio, left, rim, no JSON, and no address of a JSON file"]);
  assert.deepEqual(await told({ src, light: '{"ambient": [1, 1, "1"]}' }), ["ambient: is not three numbers of at most 1e9"]);
  assert.match((await told({ src, light: "nowhere.json" }))[0], /^nowhere.json: cannot be loaded: the server answers 404/);
  const [unknown] = await told({ src: "joints.avatar", light: "rim" });
  assert.match(unknown, /light: its colours hold an unknown light; make it with `pack --relight`$/);
});
