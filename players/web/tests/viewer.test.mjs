// The viewer page, used as a person uses it: node --test tests/viewer.test.mjs. BACKEND=webgpu takes the other backend.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { join } from "node:path";
import { after, before, test } from "node:test";
import {
  BACKEND, PACKS, RECORDING, WAIT_MS, begin, changes, columnOf, drag, drop, edited, end, errors, imageOf, message,
  middle, newPage, open, opened, page, picture, server, settled, slider, undriven, valueOf, visible,
} from "./viewer_page.mjs";

const check = (name, run) => test(name, { timeout: 240_000 }, run);

before(begin);
after(end);

check("shows the avatar, draws only after changes", async () => {
  await opened("joints");
  const { alpha } = await picture();
  assert.ok(alpha > 1, "nothing is drawn");
  const frames = await page.evaluate(() => window.avatarViewer.frames);
  await new Promise((done) => setTimeout(done, 400));
  assert.equal(await page.evaluate(() => window.avatarViewer.frames), frames);
  assert.match(await page.$eval("#numbers", (element) => element.textContent), /^\d+ splats/);
  assert.equal(await page.evaluate(() => window.avatarViewer.player.backend), BACKEND);
  assert.deepEqual(errors, []);
});

check("orbits, moves and zooms", async () => {
  const [x, y] = await middle();
  await changes(() => drag([x, y], [x + 40, y + 10]));
  await changes(() => drag([x, y], [x + 15, y], { button: "right" }));
  await changes(() => page.mouse.wheel({ deltaY: -200 }));
  await page.keyboard.press("r"); // front view again
  await changes(() => page.keyboard.press("ArrowLeft"));
});

check("touch: one finger orbits, two zoom", async () => {
  const [x, y] = await middle();
  await changes(async () => {
    await page.touchscreen.touchStart(x, y);
    await page.touchscreen.touchMove(x + 30, y);
    await new Promise((done) => setTimeout(done, 60));
    await page.touchscreen.touchEnd();
  });
  const session = await page.createCDPSession();
  const touch = (type, ...points) =>
    session.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([px, py], id) => ({ x: px, y: py, id })) });
  await changes(async () => {
    await touch("touchStart", [x - 10, y], [x + 10, y]);
    await touch("touchMove", [x - 30, y], [x + 30, y]);
    await touch("touchEnd");
  });
});

check("a slider moves the avatar, and resets", async () => {
  await opened("joints", { width: 900, height: 300 });
  await page.evaluate(() => document.querySelectorAll("#sections details").forEach((one) => (one.open = true)));
  const rest = await picture();
  await page.waitForSelector(slider("jawOpen"));
  await page.$eval(slider("jawOpen"), (input) => input.scrollIntoView());
  const box = await (await page.$(slider("jawOpen"))).boundingBox();
  await changes(() => drag([box.x + 8, box.y + box.height / 2], [box.x + box.width - 4, box.y + box.height / 2]));
  assert.ok((await valueOf("jawOpen")) > 0.9);
  assert.ok((await page.evaluate(() => window.avatarViewer.instance.pose.expressionWeights[0])) > 0.9);
  await page.click('button[aria-label="Reset Expressions"]');
  assert.deepEqual(await picture(), rest);
  await page.focus(slider("jawOpen"));
  await changes(() => page.keyboard.press("End"));
  await page.keyboard.press("Backspace");
  assert.deepEqual(await picture(), rest);
});

check("the search finds sliders by name", async () => {
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press("/");
  await page.keyboard.type("smile");
  const rows = await visible("#sections .row");
  assert.ok(rows.length >= 2 && rows.every((text) => /smile/i.test(text)), String(rows));
  assert.match(await page.$eval("#found", (element) => element.textContent), /^\d+ found$/);
  await page.$eval("#search", (input) => {
    input.value = "";
    input.dispatchEvent(new Event("input"));
  });
  assert.ok((await visible("#sections .row")).length > rows.length);
});

check("ARKit sliders drive the avatar where it has a driving", async () => {
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press("Backspace"); // the pose at rest
  const [, arkit] = await page.$$(slider("jawOpen"));
  await arkit.focus();
  await changes(() => page.keyboard.press("PageUp"));
  const { weight, input } = await page.evaluate((at) => {
    const [, arkit] = document.querySelectorAll(at);
    const { pose, avatar } = window.avatarViewer.instance;
    const { inputs, outputs, matrix } = avatar.driving;
    const gain = matrix[outputs.indexOf("expression/jawOpen") * inputs.length + inputs.indexOf("jawOpen")];
    return { weight: pose.expressionWeights[0], input: gain * arkit.valueAsNumber };
  }, slider("jawOpen"));
  assert.ok(input !== 0 && Math.abs(weight - input) < 1e-7, `${weight} is not ${input}`);
});

check("joints turn by degrees", async () => {
  await page.focus(slider("neck x").replace("neck", await page.$eval("#sections details:nth-of-type(4) .group summary", (one) => one.textContent)));
  await changes(async () => {
    for (let i = 0; i < 3; i++) await page.keyboard.press("PageUp");
  });
});

check("a clip plays, stops, steps", async () => {
  await opened("joints");
  await page.select("#clip", await page.$eval("#clip option", (option) => option.value));
  const start = await page.evaluate(() => window.avatarViewer.frames);
  await page.keyboard.press(" ");
  await page.waitForFunction((before) => window.avatarViewer.frames > before + 5, { timeout: WAIT_MS }, start);
  await page.keyboard.press(" ");
  await settled();
  const frames = await page.evaluate(() => window.avatarViewer.frames);
  assert.equal(await page.$eval("#play-button", (button) => button.getAttribute("aria-label")), "Play");
  await page.$eval("#timeline", (input) => {
    input.value = "0";
    input.dispatchEvent(new Event("input"));
  });
  await changes(() => page.keyboard.press("."));
  assert.ok((await page.evaluate(() => window.avatarViewer.frames)) > frames);
});

check("a dropped recording plays by the driving", async () => {
  await changes(async () => {
    await drop(["take.csv", await readFile(RECORDING)]);
    await message("take.csv plays");
    await new Promise((done) => setTimeout(done, 500));
    await page.keyboard.press(" ");
  });
  assert.equal(await page.$eval("#clip", (list) => list.selectedOptions[0].text), "take.csv");
});

check("live input moves the avatar, and the page answers", async () => {
  await page.click("#live-button");
  const live = (time, weight) => {
    const weights = new Array(52).fill(weight);
    const still = [0, 0, 0];
    return page.evaluate((frame) => window.hear(frame), { type: "live", time, weights, head: still, left_eye: still, right_eye: still, received_ms: 0 });
  };
  await live(1, 0);
  await changes(() => live(2, 0.4));
  await page.waitForFunction(() => window.said.some((one) => one.type === "shown" && one.time === 2), { timeout: WAIT_MS });
  assert.match(await page.$eval("#live-state", (element) => element.textContent), /^Live: \d+ frames a second$/);
  await page.evaluate(() => window.hear({ type: "live", time: 3, weights: ["nonsense"] }));
  await page.evaluate(() => window.hear({ type: "message", text: "two faces" }));
  await message("two faces");
});

check("the picture follows the window, and a second avatar takes the place", async () => {
  const before = await picture();
  await page.setViewport({ width: 300, height: 240 });
  assert.notEqual((await picture()).floats, before.floats);
  const instance = await page.evaluateHandle(() => window.avatarViewer.instance);
  await changes(async () => {
    await drop(["second.avatar", edited(await readFile(join(PACKS, "surface.avatar")), undriven)]);
    await page.waitForFunction((old) => window.avatarViewer.instance !== old, { timeout: WAIT_MS }, instance);
  });
  assert.equal(await page.evaluate(() => window.avatarViewer.player.instances.length), 1);
});

check("a recording for an avatar without driving is refused, and the picture stays", async () => {
  const before = await picture();
  await drop(["take.csv", await readFile(RECORDING)]);
  await message("take.csv: ");
  await message("no ARKit driving");
  await drop(["junk.csv", Buffer.from("junk")], ["junk.bin", Buffer.from([0, 1, 2, 0])]);
  await message("junk.bin: ");
  assert.deepEqual(await picture(), before);
});

check("a lost device: a message, the last picture, a restart in the same pose", async () => {
  await opened("joints", { width: 900, height: 260 });
  await page.evaluate(() => {
    window.avatarViewer.instance.pose.setExpression("jawOpen", 1);
    window.avatarViewer.draw();
  });
  const before = await picture();
  await page.evaluate((backend) => {
    const canvas = document.querySelector("canvas[role=application]");
    if (backend === "webgl2") canvas.getContext("webgl2").getExtension("WEBGL_lose_context").loseContext();
    else canvas.getContext("webgpu").getConfiguration().device.destroy();
  }, BACKEND);
  await message("was lost");
  const still = await page.$eval("canvas.still", (canvas) => {
    const pixels = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return new Set(new Uint32Array(pixels.buffer)).size;
  });
  assert.ok(still > 10, "the last picture is gone");
  await page.click("#messages button.text");
  await page.waitForFunction(() => window.avatarViewer.player !== null, { timeout: WAIT_MS });
  assert.deepEqual(await picture(), before);
});

for (const [avatar, part] of [["cut", "cut"], ["newer", "newer"], ["nothing", "nothing"], ["gone", "There is no avatar gone"]]) {
  check(`a message for a pack that is ${avatar}, without a picture`, async () => {
    await open(avatar);
    await message(part);
    assert.equal(await page.evaluate(() => window.avatarViewer.instance), null);
    assert.ok(await page.$eval("#loading", (box) => box.hidden));
  });
}

check("saves a picture and a video", async () => {
  await opened("joints");
  await page.evaluate(() => {
    window.saved = [];
    URL.createObjectURL = (blob) => `data:,${window.saved.push(blob)}`;
    HTMLAnchorElement.prototype.click = function () {
      window.names = [...(window.names ?? []), this.download];
    };
  });
  await page.keyboard.press("p");
  await message("Saved Full");
  await page.keyboard.press("v");
  await new Promise((done) => setTimeout(done, 700));
  await page.keyboard.press("v");
  await page.waitForFunction(() => window.saved.length === 2, { timeout: WAIT_MS });
  const { larger, colours, size } = await page.evaluate(async () => {
    const image = await createImageBitmap(window.saved[0]);
    const { canvas } = window.avatarViewer.player;
    const copy = new OffscreenCanvas(image.width, image.height).getContext("2d");
    copy.drawImage(image, 0, 0);
    const pixels = copy.getImageData(0, 0, image.width, image.height).data;
    const larger = [image.width - canvas.width, image.height - canvas.height];
    return { larger, colours: new Set(new Uint32Array(pixels.buffer)).size, size: window.saved[1].size };
  });
  assert.deepEqual(larger, [0, 0]);
  assert.ok(colours > 10, "the picture is empty");
  assert.ok(size > 1000, `a video of ${size} bytes`);
  assert.match((await page.evaluate(() => window.names)).join(" "), /^\S+\.png \S+\.(webm|mp4)$/);
});

check("several avatars make a gallery", async () => {
  await open("gone"); // the gallery shows what is there
  await message("There is no avatar gone");
  await page.click("#messages .close");
  assert.deepEqual(await visible(".message"), []);
  assert.deepEqual(await visible("#tiles strong"), ["joints", "surface", "cut", "newer", "nothing", "right", "left"]);
  await page.click("#tiles a");
  await page.evaluate(() => window.avatarViewer.ready.catch(() => undefined));
  await page.waitForFunction(() => window.avatarViewer.instance !== null, { timeout: WAIT_MS });
  assert.match(page.url(), /avatar=joints/);
});

check("every control has a name, and the help lists the keys", async () => {
  await opened("joints", { width: 900, height: 400 });
  await page.evaluate(() => document.querySelectorAll("details").forEach((one) => (one.open = true)));
  const nameless = await page.$$eval("button, input, select, canvas[tabindex]", (all) =>
    all.filter((one) => !(one.getAttribute("aria-label") || one.labels?.[0]?.innerText || one.innerText)).map((one) => one.outerHTML));
  assert.deepEqual(nameless, []);
  await page.keyboard.press("?");
  assert.match((await visible("#help"))[0], /Play or pause/);
  await page.keyboard.press("Escape");
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
});

check("a published avatar with clips moves as soon as it is there", async () => {
  const label = () => page.$eval("#play-button", (button) => button.getAttribute("aria-label"));
  for (const [motion, expected] of [["no-preference", "Pause"], ["reduce", "Play"]]) {
    await newPage();
    await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: motion }]);
    await page.goto(`${server.address}/published/index.html?backend=${BACKEND}&avatar=joints`);
    await page.evaluate(() => window.avatarViewer.ready);
    assert.equal(await label(), expected);
  }
});

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
    await opened(hand, { width: 900, height: 300 });
    await page.evaluate(() => document.querySelectorAll("#sections details").forEach((one) => (one.open = true)));
    for (const [name, value] of [["mouthSmileLeft", 1], ["neck y", 12], ["neck x", 6]]) {
      await page.waitForSelector(slider(name));
      await page.$eval(slider(name), (input, given) => {
        input.value = given;
        input.dispatchEvent(new Event("input", { bubbles: true }));
      }, value);
    }
    assert.equal(await valueOf("neck y"), 12);
    const image = await imageOf();
    assert.ok(columnOf(image, 0) > 0.55, `the mole is at ${columnOf(image, 0)}`);
    assert.ok(columnOf(image, 1) > columnOf(image, 2), "the mouth is mirrored");
    images.push(image.pixels);
    assert.deepEqual(errors, []);
  }
  assert.ok(images[0].every((value, i) => Math.abs(value - images[1][i]) <= 1 / 255), "the images differ");
});

check("a level serves physical pixels: a screen of twice the pixels shows the finer one", async () => {
  const levels = [];
  for (const deviceScaleFactor of [1, 2]) {
    await opened("right", { width: 340, height: 120, deviceScaleFactor }); // level 1 is meant for up to 60 pixels
    await settled();
    const [level, height] = await page.evaluate(() => [window.avatarViewer.instance.level, window.avatarViewer.player.canvas.height]);
    levels.push({ level, height });
  }
  const [once, twice] = levels;
  assert.equal(twice.height, 2 * once.height);
  assert.deepEqual([once.level, twice.level], [1, 0], JSON.stringify(levels));
});
