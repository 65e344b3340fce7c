// A user's strict program, checked with the types of the package and nothing else: TYPESCRIPT names the compiler.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { cp, mkdir, mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { HERE } from "../browser.mjs";
import { PACKAGE } from "./package.mjs";

const TYPESCRIPT = process.env.TYPESCRIPT ?? join(HERE, "../node_modules/typescript");
const STRICT = ["--noEmit", "--strict", "--exactOptionalPropertyTypes", "--skipLibCheck", "false", "--target", "es2022", "--lib", "es2022,dom,dom.iterable"];

const PROGRAM = `
import { type Avatar, AvatarError, Camera, Clip, Driver, type Instance, Player, drivingFrame, load, parseLiveLinkCsv } from "avatar-export-player";
import { conform } from "avatar-export-player/conform";
import type { GaussianAvatarElement } from "avatar-export-player/element";

export async function run(canvas: HTMLCanvasElement): Promise<string> {
  const avatar: Avatar = await load("a.avatar");
  const player: Player = await Player.create(canvas, { backend: "webgpu" });
  const one: Instance = player.add(avatar);
  const pixels: Float32Array = await player.readPixels();
  new Driver(avatar).pose(drivingFrame(), one.pose);
  new Clip(avatar, 0).pose(0, one.pose);
  player.frame(new Camera(), [0, 0, 0]);
  void [AvatarError, parseLiveLinkCsv, conform, pixels];
  // @ts-expect-error: a text is no number, so the types are there
  one.pose.setExpression("jawOpen", "1");
  return player.lost;
}

export function smile(element: GaussianAvatarElement): void {
  element.src = "a.avatar";
  element.setExpression("mouthSmileLeft", 1);
}
`;

let folder;
before(async () => {
  folder = await mkdtemp(join(tmpdir(), "types-"));
  await mkdir(join(folder, "node_modules"));
  await cp(PACKAGE, join(folder, "node_modules/avatar-export-player"), { recursive: true });
  await writeFile(join(folder, "package.json"), '{ "type": "module" }');
  await writeFile(join(folder, "program.ts"), PROGRAM);
});
after(() => rm(folder, { recursive: true, force: true }));

for (const [resolution, module] of [["bundler", "esnext"], ["node16", "node16"]]) {
  test(`types are sound with moduleResolution ${resolution}`, () => {
    const compiler = [join(TYPESCRIPT, "bin/tsc"), ...STRICT, "--moduleResolution", resolution, "--module", module, "program.ts"];
    try {
      execFileSync(process.execPath, compiler, { cwd: folder, encoding: "utf8" });
    } catch (error) {
      assert.fail(error.stdout);
    }
  });
}
