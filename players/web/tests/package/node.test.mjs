// In Node, as in a page that a server renders, modules can be imported, and what needs a browser says so.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { pathToFileURL } from "node:url";
import { PACKAGE } from "./package.mjs";

const entry = (name) => import(pathToFileURL(join(PACKAGE, "dist", name)));

test("a player cannot be made, and the tag's module can be imported", async () => {
  const { AvatarError, Player } = await entry("index.js");
  for (const options of [{}, { backend: "webgl2" }, { backend: "webgpu" }]) {
    await assert.rejects(Player.create(null, options), (error) => error instanceof AvatarError && /browser/.test(error.message));
  }
  assert.equal(typeof (await entry("element.js")).GaussianAvatarElement, "function");
});
