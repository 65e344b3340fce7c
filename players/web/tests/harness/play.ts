// What runs in the page: plays frames of avatars and writes their images to the server.

import { Camera } from "../../src/camera.js";
import { conform } from "../../src/conform/conform.js";
import { load } from "../../src/load.js";
import { Player } from "../../src/player.js";

interface Shot {
  readonly name: string;
  readonly avatars: readonly { readonly file: string; readonly level?: number; readonly pose: PoseJson; readonly world?: number[] }[];
  readonly camera: { cameraFromWorld: number[]; clipFromWorld: number[]; centre: number[]; tanHalfFovX: number; tanHalfFovY: number; width: number; height: number };
}
interface PoseJson {
  readonly expressionWeights: number[];
  readonly lateWeights: number[];
  readonly jointDelta: number[];
  readonly worldFromAvatar: number[];
}

type Backend = "webgpu" | "webgl2";

/** Plays a job with one player; gives the reports of references by folder. */
async function run(backend: Backend, shots: readonly Shot[], references: readonly string[]): Promise<unknown> {
  const player = await Player.create(null, { backend });
  await play(player, shots);
  const found: Record<string, unknown> = {};
  for (const folder of references) found[folder] = await conformOne(player, folder);
  player.dispose();
  return found;
}

/** Draws shots; posts `BACKEND/NAME` as float32 [H, W, 4]. */
async function play(player: Player, shots: readonly Shot[]): Promise<void> {
  for (const shot of shots) {
    const instances = [];
    for (const one of shot.avatars) {
      const instance = player.add(await load(one.file), { level: one.level ?? 0 });
      instance.pose.expressionWeights.set(one.pose.expressionWeights);
      instance.pose.lateWeights.set(one.pose.lateWeights);
      instance.pose.jointDelta.set(one.pose.jointDelta);
      instance.pose.worldFromAvatar.set(one.pose.worldFromAvatar);
      if (one.world) instance.world.set(one.world);
      instances.push(instance);
    }
    const camera = new Camera();
    const { cameraFromWorld, clipFromWorld, centre, tanHalfFovX, tanHalfFovY, width, height } = shot.camera;
    camera.setMatrices(cameraFromWorld, clipFromWorld, centre, [tanHalfFovX, tanHalfFovY], width, height);
    player.frame(camera, null);
    await player.finished();
    const pixels = await player.readPixels();
    await fetch(`/out/${player.backend}/${shot.name}`, { method: "POST", body: pixels as Float32Array<ArrayBuffer> });
    for (const instance of instances) instance.dispose();
  }
}

async function conformOne(player: Player, folder: string): Promise<unknown> {
  const bytes = async (name: string): Promise<ArrayBuffer> => (await fetch(`${folder}/${name}`)).arrayBuffer();
  const cases = new TextDecoder().decode(await bytes("cases.json"));
  return conform(player, { mini: new Uint8Array(await bytes("mini.avatar")), cases, vectors: await bytes("vectors.safetensors") });
}

Object.assign(window, { run });
