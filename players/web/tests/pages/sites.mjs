// What `publish` wrote, served to a browser: SITES names its folder, with `one` (an avatar), `two` (a gallery), `one.html`.
import { readdir } from "node:fs/promises";
import { join, relative } from "node:path";
import { pathToFileURL } from "node:url";
import { HERE, launch, serve } from "../browser.mjs";

const { SITES } = process.env;
const PAGE = join(HERE, "../../../exporter/avatar_export/viewer_page");
export const ONE_FILE = pathToFileURL(join(SITES, "one.html")).href;

/** {address: file} of a folder, below an address. */
async function below(place, folder) {
  const entries = await readdir(folder, { recursive: true, withFileTypes: true });
  const files = entries.filter((entry) => entry.isFile()).map(({ parentPath, name }) => join(parentPath, name));
  return Object.fromEntries(files.map((file) => [`${place}/${relative(folder, file)}`, file]));
}

/** A server and a browser: `/one`, `/two`, and the viewer's own page with one avatar (`/view`) and with two (`/several`). */
export async function start() {
  const two = await below("/two", join(SITES, "two"));
  const packs = Object.keys(two).filter((path) => path.endsWith(".avatar"));
  const avatars = packs.map((file, i) => ({ id: `a${i}`, name: `Avatar ${i}`, file, preview: null, bytes: 1e6, license: "CC BY 4.0" }));
  const session = (given) => Buffer.from(JSON.stringify(given));
  const server = await serve({
    ...(await below("/one", join(SITES, "one"))),
    ...two,
    ...(await below("/view", PAGE)),
    "/view/session.json": session({ avatars: avatars.slice(0, 1), live: true }),
    ...(await below("/several", PAGE)),
    "/several/session.json": session({ avatars }),
  });
  const browser = await launch({ webgpu: false });
  let page;

  /** A new page in place of the one before; `pack`: its request is `held`, or answered by an `error`. */
  async function open(address, { pack, still = false, size } = {}) {
    await page?.close();
    page = await browser.newPage();
    if (size !== undefined) await page.setViewport(size);
    if (still) await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: "reduce" }]);
    if (pack !== undefined) {
      await page.setRequestInterception(true);
      page.on("request", (request) => {
        if (!request.url().endsWith(".avatar")) void request.continue();
        else if (pack === "error") void request.respond({ status: 200, body: "nothing" });
      });
    }
    await page.goto(address.startsWith("file:") ? address : server.address + address, { waitUntil: "domcontentloaded" });
    return page;
  }

  async function close() {
    await browser.close();
    server.close();
  }
  return { open, close };
}

/** Waits for the first picture, or the message that says why there is none. */
export const shown = (page) => page.evaluate(() => window.avatarViewer.ready.catch(() => undefined));
