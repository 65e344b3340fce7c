// What runs in the page of element.test.mjs: elements are made here, and what they take of the browser is counted.

import "../../src/element.ts";
import { Player } from "../../src/player.ts";
import { alive, countGpu } from "./counted.js";

const made = { workers: 0, fetches: 0, devices: 0 }; // since the page was opened
const contexts = []; // of WebGL2
const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = function (kind, ...options) {
  const context = getContext.call(this, kind, ...options);
  if (kind === "webgl2" && !contexts.includes(context)) contexts.push(context);
  return context;
};
const running = new Set(); // workers
const BrowserWorker = window.Worker;
window.Worker = class extends BrowserWorker {
  constructor(...given) {
    super(...given);
    made.workers++;
    running.add(this);
  }
  terminate() {
    running.delete(this);
    super.terminate();
  }
};
const fetchOf = window.fetch;
window.fetch = (...given) => {
  made.fetches++;
  return fetchOf(...given);
};
if (navigator.gpu) {
  const { requestDevice } = GPUAdapter.prototype;
  GPUAdapter.prototype.requestDevice = function (...given) {
    made.devices++;
    return requestDevice.apply(this, given);
  };
}

/** A context of WebGL of the page itself, and whether it draws. */
function ownContext() {
  const gl = getContext.call(document.createElement("canvas"), "webgl2", { preserveDrawingBuffer: true });
  const pixel = new Uint8Array(4);
  return () => {
    gl.clearColor(1, 0.5, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return !gl.isContextLost() && pixel[0] === 255 && pixel[2] === 0;
  };
}

/** A new element in the page. */
function mount(attributes, into = document.body) {
  const element = document.createElement("gaussian-avatar");
  for (const [name, value] of Object.entries({ style: "width: 120px", ...attributes })) element.setAttribute(name, value);
  element.events = [];
  for (const name of ["load", "progress", "error"]) element.addEventListener(name, (event) => element.events.push({ name, text: event.message, loaded: event.loaded, total: event.total }));
  element.frames = 0;
  element.addEventListener("frame", () => element.frames++);
  into.append(element);
  return element;
}

/** Resolves with an event of an element. */
const next = (element, name) => new Promise((done) => element.addEventListener(name, done, { once: true }));
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
const frame = () => new Promise((done) => requestAnimationFrame(done));
const canvasOf = (element) => element.shadowRoot.querySelector("canvas.view");

/** Mounts an element and waits for its first picture. */
async function shown(attributes, into) {
  const element = mount(attributes, into);
  await next(element, "load");
  return element;
}

/** Waits until an element has drawn no frame for a while. */
async function rests(element) {
  for (let seen = -1; seen !== element.frames; ) {
    seen = element.frames;
    await wait(120);
  }
}

/** A number that changes with the picture, and the sum of its alpha. */
function picture(element) {
  const { width, height } = canvasOf(element);
  const copy = Object.assign(document.createElement("canvas"), { width, height });
  const context = copy.getContext("2d");
  context.drawImage(canvasOf(element), 0, 0);
  const { data } = context.getImageData(0, 0, width, height);
  let place = 0, alpha = 0;
  for (let i = 0; i < data.length; i += 4) {
    alpha += data[i + 3] / 255;
    place += (data[i] + 2 * data[i + 1] + 3 * data[i + 2]) * (1 + (i % 997));
  }
  return { place, alpha, width };
}

/** Whether the picture of an element at rest is another one after `act`. */
async function changes(element, act) {
  await rests(element);
  const { place } = picture(element);
  await act();
  await rests(element);
  return picture(element).place !== place;
}

/** All elements go, and the page is empty. */
async function clear() {
  for (const element of document.querySelectorAll("gaussian-avatar")) element.remove();
  document.body.replaceChildren();
  await wait(20);
}

/** The address of a picture of one pixel. */
const PIXEL = "data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7";

Object.assign(window, { PIXEL, Player, alive, countGpu, made, contexts, running, ownContext, mount, next, wait, frame, canvasOf, shown, rests, picture, changes, clear });
