// A page of tests/harness with the packs of tests/data.
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { bundle } from "../bundle.mjs";
import { launch, open, serve } from "./browser.mjs";

const HERE = dirname(fileURLToPath(import.meta.url));
const PACKS = join(HERE, "../../../tests/data/packs/1.0");

/** Opens harness/NAME.ts in a browser of its own; packs are at /NAME.avatar. `script` is what the page runs. */
export async function openHarness(name, packs, options = {}) {
  const built = await bundle({ entryPoints: [join(HERE, `harness/${name}.ts`)], write: false });
  const script = built.outputFiles[0].text;
  const html = "<!doctype html><title>test</title><link rel=icon href=data:,><script type=module src=page.js></script>";
  const files = { "/index.html": Buffer.from(html), "/page.js": Buffer.from(script) };
  for (const pack of packs) files[`/${pack}.avatar`] = join(PACKS, `${pack}.avatar`);
  const server = await serve(files);
  const browser = await launch(options);
  const again = () => open(browser, `${server.address}/index.html`);
  const close = async () => {
    await browser.close();
    server.close();
  };
  return { again, close, script };
}
