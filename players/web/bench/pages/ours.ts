// This package: every weight, a joint and the camera change in every frame.

import { Camera } from "../../src/camera.js";
import { load } from "../../src/load.js";
import { Player } from "../../src/player.js";
import type { Instance } from "../../src/instance.js";
import { coverage, finish, makeCanvas, offer, yawOf, type Setup } from "./common.js";

const WHITE = [1, 1, 1] as const;
let player: Player;
let instance: Instance;
let setup: Setup;
let gl: WebGL2RenderingContext;
const camera = new Camera();
const still = new URLSearchParams(location.search).has("still"); // the pose stays

offer({
  async start(given) {
    setup = given;
    const canvas = makeCanvas(setup.size);
    player = await Player.create(canvas, { backend: "webgl2" });
    gl = canvas.getContext("webgl2") as WebGL2RenderingContext;
    instance = player.add(await load(setup.url));
  },

  async step(i) {
    draw(i);
    await player.finished();
    finish(gl);
  },

  async covered() {
    draw(0);
    await player.finished();
    return coverage(gl);
  },
});

function draw(i: number): void {
  const { expressionWeights, jointDelta } = instance.pose;
  const at = still ? 0 : i;
  for (let k = 0; k < expressionWeights.length; k++) expressionWeights[k] = 0.1 + 0.1 * Math.sin(0.2 * at + k);
  const joint = 16 * Math.min(1, jointDelta.length / 16 - 1); // the neck of a head
  if (jointDelta.length > 0) {
    const angle = 0.05 * Math.sin(0.3 * at);
    jointDelta[joint] = jointDelta[joint + 10] = Math.cos(angle);
    jointDelta[joint + 2] = Math.sin(angle);
    jointDelta[joint + 8] = -Math.sin(angle);
  }
  camera.orbit(setup.target, setup.distance, yawOf(i), 0, setup.fovY, setup.size, setup.size);
  player.frame(camera, WHITE);
}
