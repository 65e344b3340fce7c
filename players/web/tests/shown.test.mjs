// What WebGPU puts on a canvas is what a person sees: a screenshot of Chromium's headless shell against the pixels read back.
import assert from "node:assert/strict";
import { join } from "node:path";
import { test } from "node:test";
import { PACKS, PAGE, launch, open, scriptOf, serve } from "./browser.mjs";

test("a page shows the image that is read back, over its background", async () => {
  const script = Buffer.from(await scriptOf("shown"));
  const server = await serve({ "/index.html": PAGE, "/page.js": script, "/a.avatar": join(PACKS, "surface.avatar") });
  const browser = await launch({ webgpu: "shown" });
  try {
    const { page, errors } = await open(browser, `${server.address}/index.html`);
    await page.evaluate(() => window.show("a.avatar"));
    const picture = await page.screenshot({ clip: { x: 0, y: 0, width: 256, height: 256 }, encoding: "base64" });
    const { most, covered } = await page.evaluate((png) => window.compare(png), picture);
    assert.deepEqual(errors, []);
    assert.ok(covered > 0.05, `${covered} of the picture are covered`);
    assert.ok(most <= 1, `a byte differs by ${most}`); // the rounding to bytes
  } finally {
    await browser.close();
    server.close();
  }
});
