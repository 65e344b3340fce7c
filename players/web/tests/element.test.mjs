// The element <gaussian-avatar>, in a page that uses it: node --test tests/element.test.mjs.
import assert from "node:assert/strict";
import { notHere } from "./browser.mjs";
import { STILL, check, page } from "./element_page.mjs";

check("one attribute shows the avatar", async () => {
  const seen = await page.evaluate(async () => {
    const element = await window.shown({ src: "joints.avatar" });
    const canvas = window.canvasOf(element), bar = element.shadowRoot.querySelector("[role=progressbar]");
    const drawn = window.picture(element);
    return {
      alpha: drawn.alpha, size: [canvas.width, canvas.height], ratio: devicePixelRatio, names: element.events.map(({ name }) => name),
      last: element.events.findLast(({ name }) => name === "progress"), role: canvas.getAttribute("role"), label: canvas.getAttribute("aria-label"),
      tabbed: canvas.tabIndex, bar: bar.checkVisibility(), poster: element.shadowRoot.querySelector("img").checkVisibility(), avatar: element.avatar.name,
    };
  });
  assert.ok(seen.alpha > 100, "nothing is drawn");
  assert.deepEqual(seen.size, [120 * seen.ratio, 120 * seen.ratio]);
  assert.equal(seen.names.at(-1), "load");
  assert.ok(seen.last.loaded > 5000 && seen.last.loaded === seen.last.total);
  assert.deepEqual([seen.role, seen.label, seen.tabbed, seen.bar, seen.poster], ["img", seen.avatar, -1, false, false]);
});

check("attributes and properties change it at any time", async () => {
  const seen = await page.evaluate(async (still) => {
    const element = await window.shown(still);
    const canvas = window.canvasOf(element);
    const plays = await window.changes(element, async () => {
      element.autoplay = true;
      element.clip = "blink";
      for (let start = element.frames; element.frames < start + 3; ) await window.frame();
      element.pause();
    });
    element.play("nod");
    const playing = element.playing;
    element.removeAttribute("autoplay");
    element.pause();
    element.cameraControls = true;
    element.alt = "Ada";
    const described = [canvas.getAttribute("role"), canvas.getAttribute("aria-label"), canvas.tabIndex, canvas.style.touchAction];
    const loaded = window.next(element, "load");
    element.src = "levels.avatar";
    await loaded;
    await window.rests(element);
    const levels = [element.stage.instance.level];
    element.level = "0";
    await window.rests(element);
    levels.push(element.stage.instance.level, element.level);
    element.level = null;
    element.style.width = "30px";
    await window.rests(element);
    levels.push(element.stage.instance.level);
    return { plays, playing, described, levels, ratio: devicePixelRatio, attribute: element.hasAttribute("level") };
  }, STILL);
  assert.ok(seen.plays && seen.playing);
  assert.deepEqual(seen.described, ["application", "Ada. Arrow keys turn it, plus and minus zoom.", 0, "pan-y"]);
  assert.deepEqual(seen.levels.slice(1), [0, "0", 1], "the level of the attribute, then of the size");
  assert.equal(seen.attribute, false);
});

check("expressions, the pose and a picture; before the first picture they say so", async () => {
  const seen = await page.evaluate(async (still) => {
    const element = window.mount(still);
    const said = [];
    for (const act of [() => element.setExpression("jawOpen", 1), () => element.play(), () => element.toBlob()]) {
      try {
        await act();
      } catch (error) {
        said.push(`${error.name}: ${error.message}`);
      }
    }
    await window.next(element, "load");
    const names = element.avatar.expressions.map(({ name }) => name);
    const expression = await window.changes(element, async () => element.setExpression(names[0], 1));
    const joint = await window.changes(element, async () => {
      element.pose.setJoint("neck", 0, 0.5, 0);
      element.draw();
    });
    const blob = await element.toBlob();
    const { width } = await createImageBitmap(blob);
    return { said, expression, joint, blob: [blob.type, width === window.canvasOf(element).width] };
  }, STILL);
  assert.equal(seen.said.length, 3);
  for (const text of seen.said) assert.match(text, /^AvatarError: .*wait for the event load/);
  assert.deepEqual([seen.expression, seen.joint, seen.blob], [true, true, ["image/png", true]]);
});

check("idle life moves it until it is off, and a pack without driving keeps still", async () => {
  const seen = await page.evaluate(async () => {
    const [living, still] = [await window.shown({ src: "joints.avatar" }), await window.shown({ src: "still.avatar" })];
    await window.rests(still);
    const [from, before] = [living.frames, window.picture(living).place];
    while (living.frames < from + 10) await window.frame();
    const moved = window.picture(living).place !== before;
    living.idle = "off";
    await window.rests(living);
    return { moved, rest: await window.changes(living, () => window.wait(100)) };
  });
  assert.deepEqual(seen, { moved: true, rest: false });
});

check("eyes and head follow the pointer", async () => {
  await page.evaluate(async (still) => void (window.one = await window.shown({ ...still, look: "pointer" })), STILL);
  const looks = () => page.evaluate(async () => {
    for (let from = window.one.frames; window.one.frames < from + 10; ) await window.frame();
    return window.picture(window.one).place;
  });
  const before = await page.evaluate(() => window.picture(window.one).place);
  await page.mouse.move(400, 60);
  const there = await looks();
  await page.mouse.move(10, 300);
  assert.equal(new Set([before, there, await looks()]).size, 3);
});

check("out of sight it shows its poster, and neither loads nor draws", async () => {
  const seen = await page.evaluate(async () => {
    const space = Object.assign(document.createElement("div"), { style: "height: 3000px" });
    document.body.append(space);
    const fetches = window.made.fetches;
    const element = window.mount({ src: "joints.avatar", poster: window.PIXEL });
    await window.wait(150);
    const early = window.made.fetches - fetches;
    const poster = element.shadowRoot.querySelector("img").checkVisibility();
    const loaded = window.next(element, "load");
    element.scrollIntoView();
    await loaded;
    for (let from = element.frames; element.frames < from + 3; ) await window.frame();
    scrollTo(0, 0);
    await window.wait(150);
    const away = element.frames;
    await window.wait(300);
    const drawn = element.frames - away;
    element.scrollIntoView();
    for (let from = element.frames; element.frames < from + 3; ) await window.frame();
    return { early, poster, drawn };
  });
  assert.deepEqual(seen, { early: 0, poster: true, drawn: 0 });
});

check("says what is wrong where the picture would be, and goes on with the next pack", async () => {
  const seen = await page.evaluate(async () => {
    const element = window.mount({ src: "gone.avatar" });
    const alert = () => [...element.shadowRoot.querySelectorAll("[role=alert]")].filter((one) => one.checkVisibility()).map((one) => one.textContent).join();
    const texts = [];
    for (const src of ["gone.avatar", "cut.avatar"]) {
      const failed = window.next(element, "error");
      element.src = src;
      const { error, message } = await failed;
      texts.push([alert(), error.name, message]);
    }
    const loaded = window.next(element, "load");
    element.src = "joints.avatar";
    await loaded;
    element.clip = "wink";
    element.autoplay = true;
    const wrong = element.events.at(-1).text, after = alert(), bar = element.shadowRoot.querySelector("[role=progressbar]");
    element.src = "levels.avatar";
    const bars = [bar.checkVisibility()];
    element.src = null;
    bars.push(bar.checkVisibility());
    if (navigator.gpu === undefined || (await navigator.gpu.requestAdapter()) === null) {
      const failed = window.next(element, "error");
      element.src = "joints.avatar";
      element.backend = "webgpu";
      await failed;
      await window.wait(200);
    }
    bars.push(bar.checkVisibility());
    return { texts, after, wrong, bars };
  });
  const [gone, cut] = seen.texts;
  assert.match(gone[0], /^This avatar cannot be shown\.gone\.avatar: .*404/);
  assert.match(cut[0], /^This avatar cannot be shown\.cut\.avatar: .*cut/);
  assert.deepEqual([gone[1], cut[1], seen.after], ["AvatarError", "AvatarError", ""]);
  assert.match(seen.wrong, /'wink' is not a clip/);
  assert.deepEqual(seen.bars, [true, false, false], "nothing loads any more");
});

check("a lost context comes back with the same picture", async () => {
  const same = await page.evaluate(async (still) => {
    const element = await window.shown(still);
    element.setExpression(element.avatar.expressions[0].name, 1);
    await window.rests(element);
    const { place } = window.picture(element);
    const [{ player }, loaded] = [element.stage, window.contexts.findLast((gl) => !gl.isContextLost())];
    loaded.getExtension("WEBGL_lose_context").loseContext();
    while (element.stage.player === null || element.stage.player === player) await window.wait(20);
    await window.rests(element);
    return window.picture(element).place === place;
  }, STILL);
  assert.ok(same);
});

check("keys turn it, and what moves the page moves the page", async () => {
  await page.evaluate(async (still) => {
    window.one = await window.shown({ ...still, "camera-controls": "" });
    document.body.append(Object.assign(document.createElement("div"), { style: "height: 3000px" }));
    window.one.focus();
  }, STILL);
  const place = () => page.evaluate(async () => {
    await window.rests(window.one);
    return window.picture(window.one).place;
  });
  const front = await place();
  await page.keyboard.press("ArrowLeft");
  const turned = await place();
  assert.notEqual(turned, front);
  await page.keyboard.press("Home");
  assert.equal(await place(), front);
  await page.mouse.move(60, 60);
  await page.mouse.wheel({ deltaY: 40 });
  await page.waitForFunction(() => scrollY > 0, { timeout: 5000 });
  assert.equal(await place(), front);
});

check("one finger scrolls the page, across it turns the avatar, two zoom", async () => {
  await page.evaluate(async (still) => {
    window.one = await window.shown({ ...still, "camera-controls": "" });
    document.body.append(Object.assign(document.createElement("div"), { style: "height: 3000px" }));
  }, STILL);
  const session = await page.createCDPSession();
  const view = () => page.evaluate(() => {
    const { yaw, pitch, distance } = window.one.stage.orbit;
    return { yaw, pitch, distance, scrolled: scrollY };
  });
  const touch = (type, ...points) => session.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  const start = await view();
  await touch("touchStart", [60, 100]);
  for (let y = 95; y >= 30; y -= 5) await touch("touchMove", [60, y]);
  await touch("touchEnd");
  await page.waitForFunction(() => scrollY > 20, { timeout: 5000 });
  assert.deepEqual({ ...(await view()), scrolled: 0 }, start);
  await page.evaluate(() => scrollTo(0, 0));
  await touch("touchStart", [40, 60]);
  for (const x of [60, 80]) await touch("touchMove", [x, 60]);
  await touch("touchEnd");
  const turned = await view();
  assert.ok(Math.abs(turned.yaw - start.yaw) > 0.1, JSON.stringify(turned));
  await touch("touchStart", [50, 60], [70, 60]);
  await touch("touchMove", [30, 60], [90, 60]);
  await touch("touchEnd");
  const zoomed = await view();
  assert.ok(zoomed.distance < 0.8 * turned.distance, JSON.stringify(zoomed));
}, notHere);

check("a visitor who wants less motion gets none", async () => {
  await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: "reduce" }]);
  const seen = await page.evaluate(async () => {
    const element = await window.shown({ src: "joints.avatar", autoplay: "" });
    const changed = await window.changes(element, () => window.wait(200));
    return [element.playing, changed];
  });
  await page.emulateMediaFeatures([]);
  assert.deepEqual(seen, [false, false]);
}, notHere);
