// node tests/run.mjs JOB OUT: plays the shots and references of a job in headless Chromium, and writes what they gave.
//
// JOB is JSON: backends; files {address: path}; shots and references for harness/play.js. OUT gets BACKEND/NAME.f32 of
// each shot, float32 [H, W, 4], and report.json: {conform: {BACKEND: {folder: report}}, errors}.
import { mkdir, readFile, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { PAGE, launch, open, scriptOf, serve } from "./browser.mjs";

const [job, out] = [JSON.parse(await readFile(process.argv[2], "utf8")), process.argv[3]];
const server = await serve({ ...job.files, "/index.html": PAGE, "/page.js": Buffer.from(await scriptOf("play")) });
const browser = await launch();
const report = { conform: {}, errors: [] };
try {
  for (const backend of job.backends) {
    const { page, errors } = await open(browser, `${server.address}/index.html`);
    report.errors = errors;
    const play = (b, shots, references) => window.run(b, shots, references);
    report.conform[backend] = await page.evaluate(play, backend, job.shots ?? [], job.references ?? []);
    await page.close();
  }
} catch (error) {
  report.errors.push(String(error.stack ?? error));
} finally {
  await browser.close();
  server.close();
}
for (const [name, bytes] of server.written) {
  await mkdir(dirname(join(out, name)), { recursive: true });
  await writeFile(join(out, `${name}.f32`), bytes);
}
await writeFile(join(out, "report.json"), JSON.stringify(report, (_, value) => (value === Infinity ? 1e300 : value)));
process.exit(report.errors.length > 0 ? 1 : 0);
