// Pages for everybody: by axe, and by the size of what is pressed, at every width, light and dark. See sites.mjs.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { ONE_FILE, shown, start } from "./sites.mjs";

const AXE = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const WIDTHS = [320, 390, 768, 1280]; // CSS pixels
const WIDE = 720; // from which on a mouse is expected, as in viewer.css
const TOUCH = 44; // the least side of what a finger presses
const PRESSED = "button, select, input, summary, a";

let sites, page;

before(async () => {
  sites = await start();
});
after(() => sites?.close());

async function open(address, options) {
  page = await sites.open(address, options);
}

async function picture(address) {
  await open(address);
  await shown(page);
}

/** What axe finds. */
function violations() {
  return page.evaluate(async () => {
    const rules = { "target-size": { enabled: true } };
    const { violations } = await window.axe.run(document, { resultTypes: ["violations"], rules });
    return violations.flatMap(({ id, nodes }) => nodes.map(({ html, any }) => `${id}: ${html.slice(0, 90)} ${any[0]?.message ?? ""}`));
  });
}

/** What a finger cannot press well. */
function small() {
  return page.$$eval(
    PRESSED,
    (all, least) =>
      all
        .filter((one) => one.checkVisibility({ visibilityProperty: true }))
        .map((one) => [one, (one.closest("label") ?? one).getBoundingClientRect()])
        .filter(([, { width, height }]) => width > 1 && Math.min(width, height) < least)
        .map(([one, { width, height }]) => `too small for a finger: ${one.outerHTML.slice(0, 80)} ${width}x${height}`),
    TOUCH,
  );
}

async function judge() {
  await page.evaluate(AXE);
  for (const width of WIDTHS) {
    await page.setViewport({ width, height: 700 });
    const found = width < WIDE ? await small() : [];
    if (await page.evaluate(() => document.documentElement.scrollWidth > innerWidth)) found.push("wider than the window");
    for (const scheme of ["light", "dark"]) {
      await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
      found.push(...(await violations()).map((one) => `${scheme}: ${one}`));
    }
    assert.ok(found.length === 0, `${width} pixels: ${found.slice(0, 12).join("\n")}`);
  }
}

const STATES = {
  "presented": () => picture("/one/index.html?play=0"),
  "inspected": async () => {
    await page.click("#inspect-button");
    await page.$$eval("details", (all) => all.forEach((one) => (one.open = true)));
  },
  "helped": () => page.$eval("#help", (dialog) => dialog.showModal()),
  "embedded": () => picture("/one/index.html?embed&play=0"),
  "loading": async () => {
    await open("/one/index.html", { pack: "held" });
    await page.waitForFunction(() => !document.querySelector("#loading").hidden);
  },
  "failed": async () => {
    await open("/one/index.html", { pack: "error" });
    await page.waitForSelector(".message.error");
  },
  "viewed": () => picture("/view/index.html?play=0"),
  "a gallery": () => open("/two/index.html"),
  "the viewer's gallery": async () => {
    await open("/several/index.html");
    await page.waitForSelector("#tiles a");
  },
  "one file": () => picture(`${ONE_FILE}?play=0`),
};
for (const [name, reach] of Object.entries(STATES)) {
  test(`${name}: no violation`, { timeout: 120_000 }, async () => {
    await reach();
    await judge();
  });
}
