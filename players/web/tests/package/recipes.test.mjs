// The recipes of README.md with the package as npm installs it: built, opened, looked at.
import assert from "node:assert/strict";
import { cp, mkdir, mkdtemp, readFile, readdir, rm, symlink } from "node:fs/promises";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join, relative } from "node:path";
import { after, before, test } from "node:test";
import { pathToFileURL } from "node:url";
import { HERE, launch, open, serve } from "../browser.mjs";
import { PACKAGE, built } from "./package.mjs";

const EXAMPLES = join(HERE, "../examples");
const BUILT = ["vite", "react", "three"];
const COVERED = { plain: 0.1, iframe: 0.05, vite: 0.1, react: 0.1, three: 0.1 }; // of the page

let browser, folder, vite;

before(async () => {
  folder = await project();
  const require = createRequire(join(EXAMPLES, "package.json"));
  vite = await import(pathToFileURL(join(require.resolve("vite/package.json"), "../dist/node/index.js")));
  browser = await launch({ webgpu: false });
});
after(async () => {
  await browser?.close();
  await rm(folder, { recursive: true, force: true });
});

/** A copy of the examples in which the package is installed. */
async function project() {
  const made = await mkdtemp(join(tmpdir(), "recipes-"));
  const installed = join(EXAMPLES, "node_modules");
  for (const name of ["package.json", "plain", "iframe", ...BUILT]) await cp(join(EXAMPLES, name), join(made, name), { recursive: true });
  await mkdir(join(made, "node_modules"));
  for (const name of await readdir(installed)) {
    if (!name.startsWith(".")) await symlink(join(installed, name), join(made, "node_modules", name));
  }
  await cp(PACKAGE, join(made, "node_modules/avatar-export-player"), { recursive: true });
  return made;
}

/** {address: file} of all files below a folder, and an icon. */
async function filesOf(root) {
  const found = (await readdir(root, { recursive: true, withFileTypes: true })).filter((entry) => entry.isFile());
  const paths = found.map((entry) => join(entry.parentPath ?? entry.path, entry.name));
  return { "/favicon.ico": Buffer.alloc(0), ...Object.fromEntries(paths.map((path) => [`/${relative(root, path)}`, path])) };
}

/** The share of a page's picture that is not as its upper left corner. */
async function covered(page) {
  const png = await page.screenshot({ encoding: "base64" });
  return page.evaluate(async (base64) => {
    const image = await createImageBitmap(new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))]));
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let differ = 0;
    for (let at = 0; at < data.length; at += 4) differ += [0, 1, 2].some((c) => Math.abs(data[at + c] - data[c]) > 40) ? 1 : 0;
    return (4 * differ) / data.length;
  }, png);
}

/** Opens a page; waits until its avatar covers enough of it. */
async function shows(t, name, address) {
  const { page, errors } = await open(browser, address);
  let share = 0;
  for (const end = Date.now() + 60_000; share < COVERED[name] && Date.now() < end; ) share = await covered(page);
  if (process.env.PICTURES) await page.screenshot({ path: join(process.env.PICTURES, `${name}.png`) });
  t.diagnostic(`${name}: ${share.toFixed(2)} of the page`);
  assert.deepEqual(errors, []);
  assert.ok(share >= COVERED[name], `${share}`);
  await page.close();
}

test("plain HTML, and an <iframe> that embeds it", async (t) => {
  const server = await serve({ ...(await filesOf(folder)), ...built("/plain/avatar-export-player") });
  await shows(t, "plain", `${server.address}/plain/index.html`);
  await shows(t, "iframe", `${server.address}/iframe/index.html`);
  server.close();
});

test("Vite builds a page, one with React and one with three.js", async (t) => {
  const input = Object.fromEntries(BUILT.map((name) => [name, join(folder, name, "index.html")]));
  await vite.build({ root: folder, configFile: false, logLevel: "error", build: { outDir: "built", target: "es2022", rollupOptions: { input } } });
  const files = await filesOf(join(folder, "built"));
  assert.ok(Object.keys(files).some((name) => /worker.*\.js$/.test(name)), "the worker is a file");
  const server = await serve(files);
  for (const name of BUILT) await shows(t, name, `${server.address}/${name}/index.html`);
  server.close();
});

test("Vite serves the page while it is written", async (t) => {
  const icon = { name: "icon", configureServer: ({ middlewares }) => void middlewares.use("/favicon.ico", (_, response) => response.end()) };
  const options = { server: { host: "127.0.0.1", port: 0 }, optimizeDeps: { entries: ["vite/index.html"] }, plugins: [icon] };
  const server = await vite.createServer({ root: folder, configFile: false, logLevel: "error", ...options });
  await server.listen();
  await shows(t, "vite", `${server.resolvedUrls.local[0]}vite/index.html`);
  await server.close();
});
