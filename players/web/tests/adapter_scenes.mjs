// Plays scenes of avatars in three.js, Babylon.js or PlayCanvas, in headless Chromium.
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { open, serve } from "./browser.mjs";
import { bundle } from "../bundle.mjs";

const HERE = join(dirname(fileURLToPath(import.meta.url)), "harness/adapters");

const scripts = new Map(); // by entry point and stage

async function script(entry, stage) {
  const { outputFiles } = await bundle({
    entryPoints: [join(HERE, `${entry}.ts`)],
    alias: { stage: join(HERE, `${stage}.ts`) },
    write: false,
  });
  return Buffer.from(outputFiles[0].contents);
}

/** Calls `play` of harness/adapters/ENTRY.ts in a page of its own. Returns {result, written, errors}. */
export async function play(browser, entry, stage, files, ...values) {
  const key = `${entry} ${stage}`;
  if (!scripts.has(key)) scripts.set(key, script(entry, stage));
  const page = "<!doctype html><title>scene</title><link rel=icon href=data:,><script type=module src=page.js></script>";
  const server = await serve({ ...files, "/index.html": Buffer.from(page), "/page.js": await scripts.get(key) });
  try {
    const { page: tab, errors } = await open(browser, `${server.address}/index.html`);
    await tab.waitForFunction(() => window.play !== undefined, { timeout: 60_000 }).catch((error) => {
      throw new Error([error.message, ...errors].join("\n"));
    });
    const result = await tab.evaluate((all) => window.play(...all), values);
    await tab.close();
    return { result, written: Object.fromEntries(server.written), errors };
  } finally {
    server.close();
  }
}

/**
 * Plays `steps` (see harness/adapters/page.ts) with an engine. `files` maps addresses to packs. Returns {pictures:
 * {name: RGBA bytes, first row on top}, errors}.
 */
export async function playScene(browser, stage, options, files, steps) {
  const { result, written, errors } = await play(browser, "page", stage, files, options, steps);
  return { pictures: written, errors: [...errors, ...result] };
}
