// Headless Chromium, with WebGPU where it is asked for.
import { existsSync } from "node:fs";
import puppeteer from "puppeteer-core";

// SwiftShader draws on the CPU. With Vulkan there is WebGPU too. Chromium loses its device when a canvas of the page
// presents; its headless shell does not.
const PLAIN = ["--no-sandbox", "--enable-unsafe-swiftshader"];
const WEBGPU = ["--enable-unsafe-webgpu", "--enable-features=Vulkan", "--use-vulkan=swiftshader", "--use-angle=vulkan"];
// AVATAR_GPU=1: both APIs by the Vulkan driver of the machine's own GPU, also where there is no display.
const GPU = ["--no-sandbox", "--ignore-gpu-blocklist", "--enable-unsafe-webgpu", "--enable-features=Vulkan", "--use-vulkan=native", "--use-angle=vulkan", "--disable-vulkan-surface"];
// A Vulkan driver of the system takes the place of SwiftShader, and then there is no WebGL2.
const DRIVER = "/usr/lib/chromium/vk_swiftshader_icd.json";
const MOST_TRIALS = 5;
const PROGRAMS = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

export const SHELL = "/usr/bin/chromium-headless-shell";

export async function launch({ webgpu, args, serve, protocolTimeout }) {
  const own = process.env.AVATAR_GPU === "1";
  const flags = own ? [...GPU, ...args] : [...PLAIN, ...(webgpu ? WEBGPU : []), ...args];
  const executablePath = (webgpu === "shown" ? [process.env.CHROMIUM, SHELL] : PROGRAMS).find((path) => path && existsSync(path));
  const env = existsSync(DRIVER) && !own ? { ...process.env, VK_ICD_FILENAMES: DRIVER } : process.env;
  for (let trial = 1; ; trial++) {
    const browser = await puppeteer.launch({ executablePath, args: flags, env, protocolTimeout });
    if (!webgpu || trial === MOST_TRIALS || (await hasAdapter(browser, serve))) return browser;
    await browser.close();
  }
}

/** Now and then the process for graphics starts without the software GPU: then the browser has to start again. */
async function hasAdapter(browser, serve) {
  const server = await serve({ "/index.html": Buffer.from("<!doctype html><link rel=icon href=data:,>") });
  const page = await browser.newPage();
  await page.goto(`${server.address}/index.html`);
  const found = await page.evaluate(async () => (await navigator.gpu?.requestAdapter()) != null);
  await page.close();
  server.close();
  return found;
}
