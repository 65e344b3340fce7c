// WebKitGTK's MiniBrowser by WebKitWebDriver, with those calls of Puppeteer's pages that the tests make. It has one window.
import { existsSync } from "node:fs";
import { createServer } from "node:net";
import { display, ended, started } from "./display.mjs";

const FOLDER = `/usr/lib/${process.arch === "arm64" ? "aarch64" : "x86_64"}-linux-gnu`;
const PROGRAMS = ["4.1", "4.0"].map((version) => `${FOLDER}/webkit2gtk-${version}/MiniBrowser`);
const NARROWEST = 450; // points of a window with the buttons of MiniBrowser
const START_MS = 60_000, STEP_MS = 50;
const ELEMENT = "element-6066-11e4-a52e-4f735466cecf"; // the key of an element in WebDriver's JSON
const KEYS = { Backspace: "\ue003", Escape: "\ue00c", PageUp: "\ue00e", End: "\ue010", Home: "\ue011", ArrowLeft: "\ue012" };
const SHIFT = "\ue008";
const BUTTONS = { left: 0, middle: 1, right: 2 };
const pause = (ms) => new Promise((done) => setTimeout(done, ms));

/** What the driver runs: a function or an expression with its values; it gives its answer, and what failed in the page before. */
const runs = (code) => `
  const [values, done] = arguments;
  if (!window.failures) {
    window.failures = [];
    addEventListener("error", (event) => failures.push(event.message));
    addEventListener("unhandledrejection", (event) => failures.push(String(event.reason)));
  }
  Promise.resolve().then(() => (${code})).then((made) => (typeof made === "function" ? made(...values) : made)).then(
    (value) => done({ value, failures: failures.splice(0) }),
    (error) => done({ error: String(error), failures: failures.splice(0) }));`;

async function freePort() {
  const server = createServer();
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  const { port } = server.address();
  await new Promise((done) => server.close(done));
  return port;
}

/** A session of the driver: `call(method, path, body)`. */
async function connect(port, protocolTimeout) {
  const ask = async (method, path, body) => {
    const answer = await fetch(`http://127.0.0.1:${port}${path}`, { method, body: body && JSON.stringify(body), signal: AbortSignal.timeout(protocolTimeout) });
    const { value } = await answer.json();
    if (!answer.ok) throw new Error(`WebKitWebDriver: ${path}: ${value?.message || value?.error}`);
    return value;
  };
  for (const end = Date.now() + START_MS; ; await pause(STEP_MS)) {
    const ready = await ask("GET", "/status").catch(() => null);
    if (ready !== null) break;
    if (Date.now() > end) throw new Error("WebKitWebDriver: does not answer");
  }
  const options = { binary: PROGRAMS.find((path) => existsSync(path)), args: ["--automation"] };
  const asked = { "webkitgtk:browserOptions": options, timeouts: { script: protocolTimeout, pageLoad: protocolTimeout } };
  const { sessionId, capabilities } = await ask("POST", "/session", { capabilities: { alwaysMatch: asked } });
  const call = (method, path, body) => ask(method, `/session/${sessionId}${path}`, body);
  return { call, version: `${capabilities.browserName}/${capabilities.browserVersion}` };
}

/** An element by its selector and place, found anew for each call. */
class Element {
  constructor(page, selector, index) {
    Object.assign(this, { page, selector, index });
  }

  #do(run) {
    return this.page.evaluate(`(selector, index) => (${run})(document.querySelectorAll(selector)[index])`, this.selector, this.index);
  }

  focus = () => this.#do((element) => element.focus());
  boundingBox = () => this.#do((element) => {
    const { x, y, width, height } = element.getBoundingClientRect();
    return { x, y, width, height };
  });
}

class Page {
  #call;
  #serve;
  #heard = [];
  #at = [0, 0];

  constructor(call, serve) {
    this.#call = call;
    this.#serve = serve;
  }

  on(event, listener) {
    if (event === "pageerror") this.#heard.push(listener);
  }

  async goto(address) {
    await this.#call("POST", "/url", { url: address });
    await this.evaluate("0"); // listens to errors from here on
  }

  evaluateOnNewDocument(run) {
    this.#serve.first = `(${run})();`;
  }

  async close() {
    this.#serve.first = "";
    await this.#call("POST", "/url", { url: "about:blank" });
  }

  url = () => this.evaluate("location.href");

  async evaluate(run, ...values) {
    const { value, error, failures } = await this.#call("POST", "/execute/async", { script: runs(run), args: [values] });
    for (const message of failures) for (const listener of this.#heard) listener(new Error(message));
    if (error !== undefined) throw new Error(error);
    return value;
  }

  $ = async (selector) => new Element(this, selector, 0);
  $eval = (selector, run, ...values) => this.evaluate(`(at, ...values) => (${run})(document.querySelector(at), ...values)`, selector, ...values);
  $$eval = (selector, run, ...values) => this.evaluate(`(at, ...values) => (${run})([...document.querySelectorAll(at)], ...values)`, selector, ...values);
  async $$(selector) {
    const count = await this.$$eval(selector, (all) => all.length);
    return Array.from({ length: count }, (_, index) => new Element(this, selector, index));
  }

  async waitForFunction(run, { timeout }, ...values) {
    for (const end = Date.now() + timeout; !(await this.evaluate(run, ...values)); await pause(STEP_MS)) {
      if (Date.now() > end) throw new Error(`waited ${timeout} ms for ${run}`);
    }
  }

  waitForSelector = (selector) => this.waitForFunction((at) => document.querySelector(at) !== null, { timeout: START_MS }, selector);
  focus = (selector) => this.$eval(selector, (element) => element.focus());
  select = (selector, value) => this.$eval(selector, (list, given) => {
    list.value = given;
    for (const name of ["input", "change"]) list.dispatchEvent(new Event(name, { bubbles: true }));
  }, value);

  async click(selector) {
    const found = await this.#call("POST", "/element", { using: "css selector", value: selector });
    await this.#call("POST", `/element/${found[ELEMENT]}/click`, {});
  }

  /** The window is as much larger than the page as it was before, and never narrower than its buttons. */
  async setViewport({ width, height }) {
    const [outer, inner] = [await this.#call("GET", "/window/rect"), await this.evaluate("[innerWidth, innerHeight]")];
    const wanted = [Math.max(width, NARROWEST), height];
    await this.#call("POST", "/window/rect", { width: outer.width + wanted[0] - inner[0], height: outer.height + height - inner[1] });
    await this.waitForFunction((w, h) => innerWidth === w && innerHeight === h, { timeout: START_MS }, ...wanted);
  }

  screenshot = async () => Buffer.from(await this.#call("GET", "/screenshot"), "base64");

  #act = (source, ...actions) => this.#call("POST", "/actions", { actions: [{ ...source, actions }] });
  #keys = (...actions) => this.#act({ type: "key", id: "keyboard" }, ...actions);
  #pointer = (...actions) => this.#act({ type: "pointer", id: "mouse", parameters: { pointerType: "mouse" } }, ...actions);

  keyboard = {
    press: (key) => {
      const held = key === "?" ? [SHIFT] : []; // without it, a driver that has seen "/" presses that
      return this.#keys(...["keyDown", "keyUp"].flatMap((type) => [...held, KEYS[key] ?? key].map((value) => ({ type, value }))));
    },
    type: async (text) => {
      for (const key of text) await this.keyboard.press(key);
    },
  };

  mouse = {
    move: async (x, y, { steps = 1 } = {}) => {
      const [fromX, fromY] = this.#at;
      const at = (from, to, step) => Math.round(from + ((to - from) * step) / steps);
      const moves = Array.from({ length: steps }, (_, i) => ({ type: "pointerMove", duration: 0, x: at(fromX, x, i + 1), y: at(fromY, y, i + 1) }));
      await this.#pointer(...moves);
      this.#at = [x, y];
    },
    down: ({ button = "left" } = {}) => this.#pointer({ type: "pointerDown", button: BUTTONS[button] }),
    up: ({ button = "left" } = {}) => this.#pointer({ type: "pointerUp", button: BUTTONS[button] }),
    wheel: ({ deltaX = 0, deltaY = 0 }) => {
      const [x, y] = this.#at.map(Math.round);
      return this.#act({ type: "wheel", id: "wheel" }, { type: "scroll", x, y, deltaX, deltaY, duration: 0 });
    },
  };
}

export async function launch({ protocolTimeout, serve }) {
  const screen = await display();
  const port = await freePort();
  // Without a GPU, its buffers that share memory with the display stay empty.
  const env = { ...screen.environment, WEBKIT_DISABLE_DMABUF_RENDERER: "1" };
  const driver = started("WebKitWebDriver", [`--port=${port}`], { env });
  const end = () => ended(driver).then(screen.close);
  try {
    const { call, version } = await connect(port, protocolTimeout);
    return {
      version: async () => version,
      newPage: async () => new Page(call, serve),
      close: () => call("DELETE", "").catch(() => undefined).then(end),
    };
  } catch (error) {
    await end();
    throw error;
  }
}
