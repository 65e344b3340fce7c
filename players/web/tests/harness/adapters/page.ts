// Plays scenes in one engine, and posts their pictures to the server.

import { load } from "../../../src/load.js";
import { makeStage } from "stage";
import type { Stage, StageOptions } from "./stage.js";

type Step = readonly [string, ...unknown[]];

/**
 * Runs the steps of a scene: ["add", file], ["place", actor, x, y, z, yaw, scale], ["show", actor, visible],
 * ["dispose", actor], ["wall", z], ["picture", name], ["disposeAvatars"]. Returns the errors of the graphics interface.
 */
async function play(options: StageOptions, steps: readonly Step[]): Promise<string[]> {
  const stage: Stage = await makeStage(options);
  const actors: ReturnType<Stage["add"]>[] = [];
  const found: string[] = [];
  for (const [what, ...values] of steps) {
    const [first] = values;
    if (what === "add") actors.push(stage.add(await load(first as string)));
    else if (what === "place") actors[first as number]!.place(...(values.slice(1) as [number, number, number, number, number]));
    else if (what === "show") actors[first as number]!.show(values[1] as boolean);
    else if (what === "dispose") actors[first as number]!.dispose();
    else if (what === "wall") stage.wall(first as number | null);
    else if (what === "disposeAvatars") stage.disposeAvatars();
    else await fetch(`/out/${first as string}`, { method: "POST", body: (await stage.picture()) as Uint8Array<ArrayBuffer> });
    found.push(...(await stage.errors()).map((error) => `${what}: ${error}`));
  }
  return found;
}

Object.assign(window, { play });
