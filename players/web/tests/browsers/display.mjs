// A display, a folder and processes of a browser that shows a window: all of them end with `close`, or when this process dies.
import { spawn } from "node:child_process";
import { mkdtemp, rm } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";

/** Starts a program that dies with this process. `stdio` is that of `spawn`. */
export function started(program, args, options = {}) {
  return spawn("setpriv", ["--pdeathsig", "KILL", program, ...args], { stdio: "ignore", ...options });
}

export async function ended(child) {
  if (child.exitCode !== null || child.signalCode !== null) return;
  const gone = new Promise((done) => child.once("exit", done));
  child.kill("SIGKILL");
  await gone;
}

/** A display and a home of its own; `environment` names them to a browser, which draws on the CPU. */
export async function display() {
  const home = await mkdtemp(join(tmpdir(), "browser-"));
  const server = started("Xvfb", ["-displayfd", "3", "-screen", "0", "1280x1024x24", "-nolisten", "tcp"], { stdio: ["ignore", "ignore", "ignore", "pipe"] });
  const number = await new Promise((done, fail) => {
    let text = "";
    server.stdio[3].on("data", (part) => (text += part).endsWith("\n") && done(text.trim()));
    server.once("error", fail);
    server.once("exit", () => fail(new Error("Xvfb: ended")));
  });
  const environment = { ...process.env, DISPLAY: `:${number}`, HOME: home, XDG_RUNTIME_DIR: home, GDK_BACKEND: "x11", LIBGL_ALWAYS_SOFTWARE: "1" };
  delete environment.WAYLAND_DISPLAY;
  const close = async () => {
    await ended(server);
    await rm(home, { recursive: true, force: true, maxRetries: 5 });
  };
  return { environment, close };
}
