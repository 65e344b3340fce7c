// What a visitor of a published page sees and does. See sites.mjs.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { ONE_FILE, shown, start } from "./sites.mjs";

const SIZES = [{ width: 900, height: 600 }, { width: 390, height: 700 }];
const STILL = "#stage canvas.view";
const check = (name, run) => test(name, { timeout: 120_000 }, run);
let sites;

before(async () => {
  sites = await start();
});
after(() => sites?.close());

const visible = (page, selector) =>
  page.$$eval(selector, (all) => all.filter((one) => one.checkVisibility({ visibilityProperty: true })).map((one) => one.id));
const controls = (page) => visible(page, "button, select, input, #panel, #transport, #statistics");

check("a page opens with the avatar alone, and one button leads to the controls and back", async () => {
  const page = await sites.open("/one/index.html");
  await shown(page);
  assert.deepEqual(await controls(page), ["inspect-button"]);
  const { width, height } = await (await page.$(STILL)).boundingBox();
  assert.deepEqual([width, height], await page.evaluate(() => [innerWidth, innerHeight]));
  await page.keyboard.press("i");
  assert.ok((await controls(page)).includes("panel"));
  await page.focus("#inspect-button");
  await page.keyboard.press("Enter");
  assert.deepEqual(await controls(page), ["inspect-button"]);
  assert.equal(await page.evaluate(() => document.activeElement.id), "inspect-button");
  await page.keyboard.press("c"); // what is not shown does nothing
  assert.deepEqual(await controls(page), ["inspect-button"]);
});

check("the avatar lives after its clip, and keeps still where motion is to be reduced", async () => {
  for (const still of [false, true]) {
    const page = await sites.open("/one/index.html", { still });
    await shown(page);
    const ended = await page.evaluate(async () => {
      const pose = () => [...window.avatarViewer.instance.pose.expressionWeights, ...window.avatarViewer.instance.pose.lateWeights].join();
      const own = () => [...window.avatarViewer.pose.expressionWeights, ...window.avatarViewer.pose.lateWeights].every((weight) => weight === 0);
      const seen = new Set();
      for (const end = performance.now() + 3000; performance.now() < end && seen.size < 20; ) {
        await new Promise((done) => setTimeout(done, 50));
        if (own()) seen.add(pose());
      }
      return seen.size;
    });
    assert.equal(ended > 1, !still, `${ended} poses`);
  }
});

check("in a frame there is nothing but the avatar", async () => {
  for (const address of ["/one/index.html?embed", "/two/joints/index.html?embed"]) {
    const page = await sites.open(address);
    await shown(page);
    assert.deepEqual(await controls(page), []);
    await page.keyboard.press("i");
    assert.deepEqual(await controls(page), []);
  }
});

check("the first picture is where the poster was", async () => {
  for (const size of SIZES) {
    const boxes = [];
    for (const pack of ["held", undefined]) {
      const page = await sites.open("/one/index.html?play=0&embed", { pack, size });
      if (pack === undefined) await shown(page);
      await page.waitForFunction((there) => getComputedStyle(document.querySelector("#poster")).opacity === there, {}, pack ? "1" : "0");
      boxes.push(await box(page));
    }
    const [poster, live] = boxes;
    const apart = poster.map((edge, i) => Math.abs(edge - live[i]));
    assert.ok(Math.max(...apart) <= 2, `${size.width}x${size.height}: ${poster} is not ${live}`);
  }
});

/** Left, top, right and bottom of what is less blue than the ground of this pack, CSS pixels. */
async function box(page) {
  await page.$eval("#loading", (bar) => bar.remove());
  const shot = await page.screenshot({ encoding: "base64" });
  return page.evaluate(async (base64) => {
    const image = await createImageBitmap(await (await fetch(`data:image/png;base64,${base64}`)).blob());
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data, width } = context.getImageData(0, 0, image.width, image.height);
    const found = [Infinity, Infinity, 0, 0];
    for (let i = 0; i < data.length; i += 4) {
      if (data[i + 2] > 200) continue;
      const x = (i / 4) % width, y = Math.floor(i / 4 / width);
      found[0] = Math.min(found[0], x);
      found[1] = Math.min(found[1], y);
      found[2] = Math.max(found[2], x);
      found[3] = Math.max(found[3], y);
    }
    return found;
  }, shot);
}

check("lines to copy show the page and its pack elsewhere", async () => {
  const page = await sites.open("/one/index.html?play=0");
  await shown(page);
  await page.click("#inspect-button");
  const lines = await page.$$eval("#share input", (all) => all.map((one) => one.value));
  const [link, frame, tag] = lines;
  assert.equal(link, new URL(".", page.url()).href);
  const { src, title } = await page.evaluate((html) => {
    const { src, title } = new DOMParser().parseFromString(html, "text/html").querySelector("iframe");
    return { src, title };
  }, frame);
  assert.deepEqual([src, title], [`${link}index.html?embed`, await page.title()]);
  const pack = /^<gaussian-avatar src="([^"]+)"><\/gaussian-avatar>$/.exec(tag)[1];
  assert.equal(await page.evaluate(async (address) => (await fetch(address)).status, pack), 200);
});

check("from a gallery to an avatar and back; one file shares nothing", async () => {
  const page = await sites.open("/two/index.html");
  await Promise.all([page.waitForNavigation(), page.click("#tiles a")]);
  await shown(page);
  await Promise.all([page.waitForNavigation(), page.click("#gallery-button")]);
  assert.equal((await page.$$("#tiles a")).length, 2);
  const single = await sites.open(`${ONE_FILE}?play=0`);
  await shown(single);
  assert.deepEqual(await controls(single), ["inspect-button"]);
  assert.equal(await single.$("#share"), null);
});
