// What runs in the page: plays frames of avatars and writes their images to the server.

import { Camera } from "../../src/camera.ts";
import { conform } from "../../src/conform/conform.ts";
import { load } from "../../src/load.ts";
import { Player } from "../../src/player.ts";

/**
 * Plays a job with one player: draws shots and posts `BACKEND/NAME` as float32 [H, W, 4]; returns the reports of
 * references by folder.
 */
async function run(backend, shots, references) {
  const player = await Player.create(null, { backend });
  for (const { name, avatars, camera: seen, light } of shots) {
    const instances = [];
    player.light = light;
    for (const { file, pose, level } of avatars) {
      const instance = player.add(await load(file), { level });
      for (const [array, values] of Object.entries(pose)) instance.pose[array].set(values);
      instances.push(instance);
    }
    const camera = new Camera();
    const tangents = [seen.tanHalfFovX, seen.tanHalfFovY];
    camera.setMatrices(seen.cameraFromWorld, seen.clipFromWorld, seen.centre, tangents, seen.width, seen.height);
    player.frame(camera, null);
    await player.finished();
    await fetch(`/out/${backend}/${name}`, { method: "POST", body: await player.readPixels() });
    for (const instance of instances) instance.dispose();
  }
  const found = {};
  for (const folder of references) {
    const bytes = async (name) => (await fetch(`${folder}/${name}`)).arrayBuffer();
    const [mini, cases, vectors] = await Promise.all(["mini.avatar", "cases.json", "vectors.safetensors"].map(bytes));
    found[folder] = await conform(player, { mini: new Uint8Array(mini), cases: new TextDecoder().decode(cases), vectors });
  }
  player.dispose();
  return found;
}

Object.assign(window, { run });
