// Firefox on a display of its own: without one it has no WebGL.
import { existsSync } from "node:fs";
import puppeteer from "puppeteer-core";
import { display } from "./display.mjs";

const PROGRAMS = ["/usr/bin/firefox-esr", "/usr/bin/firefox"];

export async function launch({ protocolTimeout }) {
  const screen = await display();
  try {
    const browser = await puppeteer.launch({
      browser: "firefox",
      executablePath: PROGRAMS.find((path) => existsSync(path)),
      headless: false,
      env: screen.environment,
      extraPrefsFirefox: { "webgl.force-enabled": true },
      protocolTimeout,
    });
    const quit = browser.close.bind(browser);
    browser.close = () => quit().finally(screen.close);
    return browser;
  } catch (error) {
    await screen.close();
    throw error;
  }
}
