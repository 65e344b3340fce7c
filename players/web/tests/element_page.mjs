// A page with elements <gaussian-avatar>, for element.test.mjs and element_life.test.mjs.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { PACKS, launch, open, scriptOf, serve } from "./browser.mjs";

const PAGE = Buffer.from("<!doctype html><title>test</title><link rel=icon href=data:,><body><script type=module src=page.js></script>");
/** Attributes of an element that keeps still. */
export const STILL = { src: "joints.avatar", idle: "off" };

export let server, page;
let browser, errors;

before(async () => {
  const joints = join(PACKS, "joints.avatar");
  const cut = (await readFile(joints)).subarray(0, 5000);
  server = await serve({
    "/index.html": PAGE, "/page.js": Buffer.from(await scriptOf("element")), "/cut.avatar": cut, "/joints.avatar": joints,
    ...(process.env.LIT ? { "/lit.avatar": process.env.LIT } : {}), // a pack that can be lit
    "/surface.avatar": join(PACKS, "surface.avatar"), "/still.avatar": join(PACKS, "surface_without_rig.avatar"), "/levels.avatar": join(PACKS, "../../mole/right.avatar"),
  });
  browser = await launch({ webgpu: false });
  ({ page, errors } = await open(browser, `${server.address}/index.html`));
});
after(async () => {
  await browser?.close();
  server?.close();
});

/** A test in the one page, which it leaves empty. */
export function check(name, run, skip = false) {
  test(name, { timeout: 240_000, skip }, async (t) => {
    errors.length = 0;
    try {
      await run(t);
    } finally {
      await page.evaluate(() => window.clear());
    }
    assert.deepEqual(errors.filter((text) => !text.includes("404")), []);
  });
}
