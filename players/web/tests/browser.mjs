// A browser for tests, Chromium or the one that AVATAR_BROWSER names: a server of given files, a page, what the page writes.
import { createServer } from "node:http";
import { readFile } from "node:fs/promises";
import { dirname, extname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { bundle } from "../bundle.mjs";

export const HERE = dirname(fileURLToPath(import.meta.url));
/** Packs that a released version wrote. */
export const PACKS = join(HERE, "../../../tests/data/packs/1.0");
/** An empty page that runs page.js. */
export const PAGE = Buffer.from("<!doctype html><title>test</title><link rel=icon href=data:,><script type=module src=page.js></script>");

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".json": "application/json" };
/** The browser of this run. */
export const BROWSER = process.env.AVATAR_BROWSER ?? "chromium";
/** What Chromium can and others cannot, here: WebGPU on a software GPU, and its own protocol: fingers, heaps, phones, screens. */
export const CHROMIUM = BROWSER === "chromium";
/** For `test`: what only Chromium is asked. */
export const notHere = CHROMIUM ? false : `not asked of ${BROWSER}`;

/** What harness/NAME.js becomes for a page; `alias`: other names of modules. */
export async function scriptOf(name, alias = {}) {
  const { outputFiles } = await bundle({ entryPoints: [join(HERE, `harness/${name}.js`)], alias, write: false });
  return outputFiles[0].text;
}

/**
 * Serves {path: file name or Buffer}, under a Content-Security-Policy if one is given; POSTs to /out/NAME go to `written`.
 * `serve.first` runs before a page's own scripts.
 */
export async function serve(files, policy) {
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
    const file = typeof found === "string" ? await readFile(found) : found;
    const body = serve.first && type === TYPES[".html"] ? Buffer.concat([Buffer.from(`<!doctype html><script>${serve.first}</script>`), file]) : file;
    const strict = policy === undefined ? {} : { "Content-Security-Policy": policy };
    response.writeHead(200, { "Content-Type": type, "Content-Length": body.length, ...strict }).end(body);
  });
  await new Promise((done) => server.listen(0, "127.0.0.1", done));
  return { address: `http://127.0.0.1:${server.address().port}`, written, close: () => server.close() };
}

/**
 * A browser; `close` it. `webgpu`: with WebGPU, for pages that show nothing on a canvas; "shown": for pages that do, in
 * Chromium's headless shell; `args`: flags of Chromium.
 */
export async function launch({ webgpu = true, args = [] } = {}) {
  const { launch } = await import(`./browsers/${BROWSER}.mjs`);
  return launch({ webgpu, args, serve, protocolTimeout: 600_000 });
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
