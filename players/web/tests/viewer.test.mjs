// The viewer page, used as a person uses it: node --test tests/viewer.test.mjs. BACKEND=webgpu takes the other backend.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { BROWSER, PACKS, notHere } from "./browser.mjs";
import {
  BACKEND, RECORDING, begin, changes, columnOf, drag, drop, end, enter, errors, imageOf, label, message, middle,
  newPage, open, opened, page, picture, server, settled, slider, texts, undriven, until, valueOf, viewer, visible,
} from "./viewer_page.mjs";

const WIDE = { width: 900, height: 300 };
const check = (name, run, skip = false) => test(name, { timeout: 240_000, skip }, run);
const press = async (...keys) => {
  for (const key of keys) await page.keyboard.press(key);
};
const frames = () => viewer((shown) => shown.frames);
const blur = () => page.evaluate(() => document.activeElement.blur());
const take = async () => ["take.csv", await readFile(RECORDING)];

before(begin);
after(end);

check("shows the avatar, draws only after changes", async () => {
  await opened("joints");
  assert.ok((await picture()).alpha > 1, "nothing is drawn");
  const drawn = await frames();
  await new Promise((done) => setTimeout(done, 400));
  assert.equal(await frames(), drawn);
  assert.match(await texts("#numbers"), /^\d+ splats/);
  assert.equal(await viewer(({ player }) => player.backend), BACKEND);
  assert.deepEqual(errors, []);
});

check("mouse and keys orbit, move and zoom", async () => {
  const [x, y] = await middle();
  await changes(() => drag([x, y], [x + 40, y + 10]));
  await changes(() => drag([x, y], [x + 15, y], { button: "right" }));
  await changes(() => page.mouse.wheel({ deltaY: -200 }));
  await press("r"); // front view again
  await changes(() => press("ArrowLeft"));
});

check("fingers orbit, move and zoom", async () => {
  const [x, y] = await middle();
  await changes(async () => {
    await page.touchscreen.touchStart(x, y);
    await page.touchscreen.touchMove(x + 30, y);
    await new Promise((done) => setTimeout(done, 60));
    await page.touchscreen.touchEnd();
  });
  const session = await page.createCDPSession();
  const touch = (type, ...xs) => session.send("Input.dispatchTouchEvent", { type, touchPoints: xs.map((px, id) => ({ x: px, y, id })) });
  await changes(async () => {
    await touch("touchStart", x - 10, x + 10);
    await touch("touchMove", x - 30, x + 30);
    await touch("touchEnd");
  });
}, notHere);

check("letters that control something are shown as escapes", async () => {
  await opened("odd");
  assert.equal(await page.$eval("#clip option", (option) => option.text), "n\\u202eo\\u001bd");
});

check("a slider moves the avatar, and resets", async () => {
  await opened("joints", WIDE);
  const rest = await picture();
  await page.waitForSelector(slider("jawOpen"));
  await page.$eval(slider("jawOpen"), (input) => input.scrollIntoView());
  const { x, y, width, height } = await (await page.$(slider("jawOpen"))).boundingBox();
  await changes(() => drag([x + 8, y + height / 2], [x + width - 4, y + height / 2]));
  assert.ok((await valueOf("jawOpen")) > 0.9);
  assert.ok((await viewer(({ instance }) => instance.pose.expressionWeights[0])) > 0.9);
  await page.click('button[aria-label="Reset Expressions"]');
  assert.deepEqual(await picture(), rest);
  await page.focus(slider("jawOpen"));
  await changes(() => press("End"));
  await press("Backspace");
  assert.deepEqual(await picture(), rest);
});

check("the search finds sliders by name", async () => {
  await blur();
  await press("/");
  await page.keyboard.type("smile");
  const rows = await visible("#sections .row");
  assert.ok(rows.length >= 2 && rows.every((text) => /smile/i.test(text)), String(rows));
  assert.match(await texts("#found"), /^\d+ found$/);
  await enter("#search", "");
  assert.ok((await visible("#sections .row")).length > rows.length);
});

check("ARKit sliders drive the avatar where it has a driving; joints turn by degrees", async () => {
  await blur();
  await press("Backspace"); // the pose at rest
  const [, arkit] = await page.$$(slider("jawOpen"));
  await arkit.focus();
  await changes(() => press("PageUp"));
  const { weight, input } = await viewer(({ instance: { pose, avatar } }, at) => {
    const { inputs, outputs, matrix } = avatar.driving;
    const gain = matrix[outputs.indexOf("expression/jawOpen") * inputs.length + inputs.indexOf("jawOpen")];
    return { weight: pose.expressionWeights[0], input: gain * document.querySelectorAll(at)[1].valueAsNumber };
  }, slider("jawOpen"));
  assert.ok(input !== 0 && Math.abs(weight - input) < 1e-7, `${weight} is not ${input}`);
  await page.focus(slider(`${await texts("#sections details:nth-of-type(4) .group summary")} x`));
  await changes(() => press("PageUp", "PageUp", "PageUp"));
});

check("a clip plays, stops, steps", async () => {
  await opened("joints");
  await page.select("#clip", await page.$eval("#clip option", (option) => option.value));
  const start = await frames();
  await press(" ");
  await until((before) => window.avatarViewer.frames > before + 5, start);
  await press(" ");
  await settled();
  const drawn = await frames();
  assert.equal(await label("#play-button"), "Play");
  await enter("#timeline", "0");
  await changes(() => press("."));
  assert.ok((await frames()) > drawn);
});

check("a dropped recording plays by the driving", async () => {
  await changes(async () => {
    await drop(await take());
    await message("take.csv plays");
    await new Promise((done) => setTimeout(done, 500));
    await press(" ");
  });
  assert.equal(await page.$eval("#clip", (list) => list.selectedOptions[0].text), "take.csv");
});

check("live input moves the avatar, and the page answers", async () => {
  await page.click("#live-button");
  const hear = (said) => page.evaluate((given) => window.hear(given), said);
  const live = (time, weight) =>
    hear({ type: "live", time, weights: Array(52).fill(weight), head: [0, 0, 0], left_eye: [0, 0, 0], right_eye: [0, 0, 0], received_ms: 0 });
  await live(1, 0);
  await changes(() => live(2, 0.4));
  await until(() => window.said.some((one) => one.type === "shown" && one.time === 2));
  assert.match(await texts("#live-state"), /^Live: \d+ frames a second$/);
  await hear({ type: "live", time: 3, weights: ["nonsense"] });
  await hear({ type: "message", text: "two faces" });
  await message("two faces");
});

check("the picture follows the window, and a second avatar takes the place", async () => {
  const before = await picture();
  await page.setViewport({ width: 300, height: 240 });
  assert.notEqual((await picture()).floats, before.floats);
  await page.evaluate(() => void (window.before = window.avatarViewer.instance));
  await changes(async () => {
    await drop(["second.avatar", undriven(await readFile(join(PACKS, "surface.avatar")))]);
    await until(() => window.avatarViewer.instance !== window.before);
  });
  assert.equal(await viewer(({ player }) => player.instances.length), 1);
});

check("a recording for an avatar without driving is refused, and the picture stays", async () => {
  const before = await picture();
  await drop(await take());
  await message("take.csv: ");
  await message("no ARKit driving");
  await drop(["junk.csv", Buffer.from("junk")], ["junk.bin", Buffer.from([0, 1, 2, 0])]);
  await message("junk.bin: ");
  assert.deepEqual(await picture(), before);
});

check("a lost device: a message, the last picture, a restart in the same pose", async () => {
  await opened("joints", { width: 900, height: 260 });
  await viewer((shown) => {
    shown.pose.setExpression("jawOpen", 1);
    shown.draw();
  });
  const before = await picture();
  await page.evaluate((backend) => {
    if (backend === "webgl2") return window.contexts.at(-1).getExtension("WEBGL_lose_context").loseContext();
    const canvas = document.querySelector("canvas[role=application]");
    canvas.getContext("webgpu").getConfiguration().device.destroy();
  }, BACKEND);
  await message("was lost");
  const still = await page.$eval(BACKEND === "webgpu" ? "canvas.still" : "canvas.view", (canvas) => {
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return new Set(new Uint32Array(pixels.buffer)).size;
  });
  assert.ok(still > 10, "the last picture is gone");
  await page.click("#messages button.text");
  await until(() => window.avatarViewer.player !== null);
  assert.deepEqual(await picture(), before);
});

check("a message for a pack that is cut, newer, nothing or gone, without a picture", async () => {
  for (const [avatar, part] of [["cut", "cut"], ["newer", "newer"], ["nothing", "nothing"], ["gone", "There is no avatar gone"]]) {
    await open(avatar);
    await message(part);
    assert.equal(await viewer(({ instance }) => instance), null, avatar);
    assert.ok(await page.$eval("#loading", (box) => box.hidden), avatar);
  }
});

check("several avatars make a gallery, also where the wanted one is missing", async () => {
  await page.click("#messages .close");
  assert.deepEqual(await visible(".message"), []);
  assert.deepEqual(await visible("#tiles strong"), ["joints", "surface", "odd", "cut", "newer", "nothing", "right", "left"]);
  await page.click("#tiles a");
  await viewer(({ ready }) => ready.catch(() => undefined));
  await until(() => window.avatarViewer.instance !== null);
  assert.match(await page.url(), /avatar=joints/);
});

check("saves a picture and a video", async () => {
  await opened("joints");
  await page.evaluate(() => {
    Object.assign(window, { saved: [], names: [] });
    URL.createObjectURL = (blob) => `data:,${window.saved.push(blob)}`;
    HTMLAnchorElement.prototype.click = function () {
      window.names.push(this.download);
    };
  });
  await press("p");
  await message("Saved Full");
  const { larger, colours } = await viewer(async ({ player: { canvas } }) => {
    const image = await createImageBitmap(window.saved[0]);
    const copy = new OffscreenCanvas(image.width, image.height).getContext("2d");
    copy.drawImage(image, 0, 0);
    const pixels = new Uint32Array(copy.getImageData(0, 0, image.width, image.height).data.buffer);
    const larger = [image.width - canvas.width, image.height - canvas.height];
    return { larger, colours: new Set(pixels).size };
  });
  assert.deepEqual(larger, [0, 0]);
  assert.ok(colours > 10, "the picture is empty");
  await press("v");
  await new Promise((done) => setTimeout(done, 700));
  await press("v");
  if (BROWSER === "webkit") return message("this browser "); // can record neither, or recorded nothing
  await until(() => window.saved.length === 2);
  const { size, names } = await page.evaluate(() => ({ size: window.saved[1].size, names: window.names.join(" ") }));
  assert.ok(size > 1000, `a video of ${size} bytes`);
  assert.match(names, /^\S+\.png \S+\.(webm|mp4)$/);
});

check("every control has a name, and the help lists the keys", async () => {
  await opened("joints", { width: 900, height: 400 });
  const nameless = await page.$$eval("button, input, select, canvas[tabindex]", (all) =>
    all.filter((one) => !(one.getAttribute("aria-label") || one.labels?.[0]?.innerText || one.innerText)).map((one) => one.outerHTML));
  assert.deepEqual(nameless, []);
  await press("?");
  await until(() => document.querySelector("#help").open);
  assert.match((await visible("#help"))[0], /Play or pause/);
  await press("Escape");
  assert.deepEqual(await visible("#help"), []);
});

check("on a phone the controls are a sheet at the bottom", async () => {
  await opened("joints", { width: 390, height: 500, hasTouch: true, isMobile: true });
  assert.deepEqual(await visible("#panel"), []);
  await page.tap("#panel-button");
  const [view, panel] = await Promise.all(["#view", "#panel"].map(async (one) => (await page.$(one)).boundingBox()));
  assert.ok(panel.y >= view.y + view.height && panel.width === 390 && view.height > 100);
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= 390), "the page is wider than the phone");
  assert.deepEqual(errors, []);
}, notHere);

check("a published avatar with clips moves as soon as it is there, unless motion is to be reduced", async () => {
  for (const [motion, expected] of [["no-preference", "Pause"], ["reduce", "Play"]]) {
    await newPage();
    await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: motion }]);
    await page.goto(`${server.address}/published/index.html?backend=${BACKEND}&avatar=joints`);
    await viewer(({ ready }) => ready);
    assert.equal(await label("#play-button"), expected);
  }
}, notHere);

check("says what is missing without WebGPU and WebGL2", async () => {
  await newPage();
  await page.evaluateOnNewDocument(() => {
    HTMLCanvasElement.prototype.getContext = () => null;
    Object.defineProperty(Navigator.prototype, "gpu", { value: undefined });
    delete Navigator.prototype.gpu;
  });
  await page.goto(`${server.address}/index.html?avatar=joints`);
  await message("neither WebGPU nor WebGL2");
});

check("packs of both handednesses show the person alike, and so do their sliders", async () => {
  const images = [];
  for (const hand of ["right", "left"]) {
    await opened(hand, WIDE);
    for (const [name, value] of [["mouthSmileLeft", 1], ["neck y", 12], ["neck x", 6]]) await enter(slider(name), value);
    assert.equal(await valueOf("neck y"), 12);
    const image = await imageOf();
    assert.ok(columnOf(image, 0) > 0.55, `the mole is at ${columnOf(image, 0)}`);
    assert.ok(columnOf(image, 1) > columnOf(image, 2), "the mouth is mirrored");
    images.push(image.pixels);
    assert.deepEqual(errors, []);
  }
  assert.ok(images[0].every((value, i) => Math.abs(value - images[1][i]) <= 1 / 255), "the images differ");
});

check("a level serves physical pixels: from its first picture a screen of twice the pixels shows the finer one", async () => {
  const seen = [];
  for (const deviceScaleFactor of [1, 2]) {
    await open("right", { width: 340, height: 120, deviceScaleFactor }); // level 1 is meant for up to 60 pixels
    seen.push(await viewer((shown) => shown.ready.then(() => [shown.instance.level, shown.player.canvas.height])));
  }
  const height = seen[0][1];
  assert.deepEqual(seen, [[1, height], [0, 2 * height]]);
}, notHere);
