// Headless Chromium for tests: a server of given files, a page, what the page writes.
import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { existsSync } from "node:fs";
import { dirname, extname, join } from "node:path";
import { fileURLToPath } from "node:url";
import puppeteer from "puppeteer-core";
import { bundle } from "../bundle.mjs";

export const HERE = dirname(fileURLToPath(import.meta.url));
/** Packs that a released version wrote. */
export const PACKS = join(HERE, "../../../tests/data/packs/1.0");
/** An empty page that runs page.js. */
export const PAGE = Buffer.from("<!doctype html><title>test</title><link rel=icon href=data:,><script type=module src=page.js></script>");

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".json": "application/json" };
// SwiftShader draws on the CPU. With Vulkan there is WebGPU too, but a canvas of the page that presents loses its device.
const PLAIN = ["--no-sandbox", "--enable-unsafe-swiftshader"];
const WEBGPU = ["--enable-unsafe-webgpu", "--enable-features=Vulkan", "--use-vulkan=swiftshader", "--use-angle=vulkan"];
const MOST_TRIALS = 5;
const PROGRAMS = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

/** What harness/NAME.js becomes for a page; `alias`: other names of modules. */
export async function scriptOf(name, alias = {}) {
  const { outputFiles } = await bundle({ entryPoints: [join(HERE, `harness/${name}.js`)], alias, write: false });
  return outputFiles[0].text;
}

/** Serves {path: file name or Buffer}; POSTs to /out/NAME go to `written`. */
export async function serve(files) {
  const written = new Map();
  const server = createServer(async (request, response) => {
    const path = new URL(request.url, "http://x").pathname;
    if (request.method === "POST" && path.startsWith("/out/")) {
      const parts = [];
      for await (const part of request) parts.push(part);
      written.set(path.slice(5), Buffer.concat(parts));
      return response.end();
    }
    const found = files[path];
    if (found === undefined) return response.writeHead(404).end();
    const type = TYPES[extname(path)] ?? "application/octet-stream";
    const body = typeof found === "string" ? await readFile(found) : found;
    response.writeHead(200, { "Content-Type": type, "Content-Length": body.length }).end(body);
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { address: `http://127.0.0.1:${server.address().port}`, written, close: () => server.close() };
}

/** A browser; `close` it. `webgpu`: with WebGPU, for pages that show nothing on a canvas. */
export async function launch({ webgpu = true, args = [] } = {}) {
  const flags = [...PLAIN, ...(webgpu ? WEBGPU : []), ...args];
  for (let trial = 1; ; trial++) {
    const browser = await puppeteer.launch({ executablePath: PROGRAMS.find((path) => path && existsSync(path)), args: flags, protocolTimeout: 600_000 });
    if (!webgpu || trial === MOST_TRIALS || (await hasAdapter(browser))) return browser;
    await browser.close();
  }
}

/** Now and then the process for graphics starts without the software GPU: then the browser has to start again. */
async function hasAdapter(browser) {
  const server = await serve({ "/index.html": Buffer.from("<!doctype html><link rel=icon href=data:,>") });
  const page = await browser.newPage();
  await page.goto(`${server.address}/index.html`);
  const found = await page.evaluate(async () => (await navigator.gpu?.requestAdapter()) != null);
  await page.close();
  server.close();
  return found;
}

/** A page at an address; errors of its scripts are thrown when `check` is called. */
export async function open(browser, address) {
  const page = await browser.newPage();
  const errors = [];
  page.on("pageerror", (error) => errors.push(error.message));
  page.on("console", (message) => {
    if (message.type() === "error") errors.push(message.text());
  });
  await page.goto(address);
  return { page, errors };
}
