// node tests/visit.mjs ADDRESS [LIVE]: opens a viewer page as a person does, and says what it shows, a line of JSON each.
//
// First {"ready", "backend", "covered"}: the share of pixels that show the avatar. With LIVE it follows live input, and says
// {"changed": share of pixels} when the picture is another one. Errors of the page's scripts are {"error"}; exit code 1.
import { launch } from "./browser.mjs";

const [address, live] = process.argv.slice(2);
const LIMIT_MS = 60_000, STEP_MS = 100, ANSWER_MS = 1000, SHARE = 0.002;
const say = (line) => console.log(JSON.stringify(line));
const browser = await launch({ webgpu: false });
let failed = false;
const fail = (error) => {
  failed = true;
  say({ error: String(error.message ?? error) });
};
try {
  const page = await browser.newPage();
  await page.setViewport({ width: 480, height: 360 });
  page.on("pageerror", fail);
  await page.goto(address);
  await page.waitForFunction(() => window.avatarViewer !== undefined, { timeout: LIMIT_MS });
  await page.evaluate(async () => {
    await window.avatarViewer.ready;
    await window.avatarViewer.draw();
    window.first = await window.avatarViewer.player.readPixels();
  });
  say(await page.evaluate(() => ({
    ready: document.title,
    backend: window.avatarViewer.player.backend,
    covered: window.first.filter((value, i) => i % 4 === 3 && value > 0.5).length / (window.first.length / 4),
  })));
  if (live !== undefined) {
    const end = Date.now() + LIMIT_MS;
    for (let share = 0; share < SHARE && Date.now() < end; ) {
      await new Promise((done) => setTimeout(done, STEP_MS));
      share = await page.evaluate(async () => {
        const now = await window.avatarViewer.player.readPixels();
        let changed = 0;
        for (let i = 0; i < now.length; i += 4) changed += Math.abs(now[i] - window.first[i]) > 0.1 ? 1 : 0;
        return changed / (now.length / 4);
      });
      if (share < SHARE) continue;
      await new Promise((done) => setTimeout(done, ANSWER_MS)); // the page reports to the server what it showed
      say({ changed: share });
    }
  }
} catch (error) {
  fail(error);
} finally {
  await browser.close();
}
process.exit(failed ? 1 : 0);
