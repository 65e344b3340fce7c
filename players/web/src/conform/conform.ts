// Plays the stages of a reference and compares them.

import type { Avatar } from "../avatar.js";
import { Camera } from "../camera.js";
import { load } from "../load.js";
import type { Player } from "../player.js";
import type { WebGpuRenderer } from "../webgpu/renderer.js";
import { judge, type Verdict } from "./judge.js";
import { parseReference, type Case, type Step, type Tensors } from "./reference.js";
import { runStage, type StageRunner } from "./stages.js";

/** The verdict of one output of one stage of one case. */
export interface ConformRow extends Verdict {
  readonly case: string;
  readonly stage: string;
  readonly output: string;
}

/** What `conform` found. */
export interface ConformReport {
  readonly backend: "webgpu" | "webgl2";
  readonly passed: boolean;
  readonly rows: readonly ConformRow[];
}

/** The files that `avatar-export pack --reference` writes, of the folder NAME.reference. */
export interface ReferenceFiles {
  readonly mini: Uint8Array; // mini.avatar
  readonly cases: string; // cases.json
  readonly vectors: ArrayBuffer; // vectors.safetensors
}

/** Profiles that this player draws: quads, so `engine` alone. */
const PROFILE = "engine";

/**
 * Runs every stage alone, from the reference's inputs, with the player's backend. The first stage that fails contains the
 * bug. A player without a canvas will do. Throws AvatarError for a `mini.avatar` that cannot be loaded.
 */
export async function conform(player: Player, files: ReferenceFiles): Promise<ConformReport> {
  const runner = await runnerOf(player, await load(files.mini));
  const reference = parseReference(files.cases, files.vectors);
  const rows: ConformRow[] = [];
  for (const one of reference.cases) {
    const camera = cameraOf(one);
    for (const step of one.stages) {
      if (step.stage === "raster" && step.profile !== PROFILE) continue;
      const inputs = named(inputsOf(step, one), reference.tensors);
      const found = await runStage(runner, step.stage, inputs, camera);
      const outputs = step.pixels === undefined ? found : atPixels(found, reference.tensors[step.pixels.tensor] as BigInt64Array);
      for (const [output, verdict] of Object.entries(judge(step, outputs, reference.tensors))) {
        rows.push({ case: one.name, stage: step.stage, output, ...verdict });
      }
    }
  }
  runner.dispose();
  return { backend: player.backend, passed: rows.every((row) => row.passed), rows };
}

/** Stages of an avatar by what draws for `player`. */
async function runnerOf({ renderer }: Player, avatar: Avatar): Promise<StageRunner> {
  if (renderer.kind === "webgpu") {
    const { WebGpuStages } = await import("../webgpu/stages.js");
    return new WebGpuStages((renderer as WebGpuRenderer).pipelines, avatar);
  }
  const [{ WebGl2Stages }, { kernelModule }] = await Promise.all([import("../webgl2/stages.js"), import("../webgl2/kernel_module.js")]);
  return new WebGl2Stages(avatar, await kernelModule());
}

function cameraOf({ camera: stored }: Case): Camera {
  const camera = new Camera();
  const tan = [stored.tan_half_fov_x, stored.tan_half_fov_y];
  const { camera_from_world: view, clip_from_world: clip } = stored;
  camera.setMatrices(view.flat(), clip.flat(), stored.centre, tan, stored.width, stored.height);
  return camera;
}

/** Stage joints poses the anchor vertices itself, so it needs the late weights that stage skin is given. */
function inputsOf(step: Step, { stages }: Case): Step["inputs"] {
  const late = stages.find(({ inputs }) => inputs["late_weights"] !== undefined)?.inputs["late_weights"];
  return step.stage === "joints" && late !== undefined ? { ...step.inputs, late_weights: late } : step.inputs;
}

function named(arrays: Step["inputs"], tensors: Tensors): Tensors {
  return Object.fromEntries(Object.entries(arrays).map(([name, array]) => [name, tensors[array.tensor] as Float32Array]));
}

/** Outputs of raster at the pixels y * width + x. */
function atPixels(outputs: Tensors, pixels: BigInt64Array): Tensors {
  const colour = outputs["colour"] as Float32Array;
  const transmittance = outputs["transmittance"] as Float32Array;
  const at = Array.from(pixels, Number);
  return {
    colour: Float32Array.from(at.flatMap((i) => [...colour.subarray(3 * i, 3 * i + 3)])),
    transmittance: Float32Array.from(at, (i) => transmittance[i] as number),
  };
}
