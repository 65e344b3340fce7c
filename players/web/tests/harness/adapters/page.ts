// Plays scenes in one engine, and posts their pictures to the server.

import { load } from "../../../src/load.js";
import { makeStage } from "stage";
import type { Stage, StageOptions } from "./stage.js";

type Step = readonly [string, ...unknown[]];

/**
 * Runs the steps of a scene: ["add", file], ["place", actor, x, y, z, yaw, scale], ["show", actor, visible],
 * ["dispose", actor], ["wall", z], ["picture", name], ["lose"], ["orthographic", name], ["disposeAvatars"]. Returns the errors of the graphics interface.
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
    else if (what === "lose") await stage.lose!();
    else if (what === "orthographic") await post(first as string, await orthographic(stage));
    else if (what === "disposeAvatars") stage.disposeAvatars();
    else await post(first as string, (await stage.picture()) as Uint8Array<ArrayBuffer>);
    found.push(...(await stage.errors()).map((error) => `${what}: ${error}`));
  }
  return found;
}

function post(name: string, body: BodyInit): Promise<Response> {
  return fetch(`/out/${name}`, { method: "POST", body });
}

/** What an orthographic camera is told. */
async function orthographic(stage: Stage): Promise<string> {
  stage.orthographic!(true);
  try {
    await stage.picture();
    return "nothing";
  } catch (error) {
    return String(error);
  } finally {
    stage.orthographic!(false);
  }
}

Object.assign(window, { play });
