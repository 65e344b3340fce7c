// This package: every weight, a joint and the camera change in every frame.

import { Camera } from "../../src/camera.js";
import { load } from "../../src/load.js";
import { Player } from "../../src/player.js";
import { makeCanvas, offer, yawOf } from "./common.js";

const WHITE = [1, 1, 1] as const;
const still = new URLSearchParams(location.search).has("still"); // the pose stays

offer(async ({ url, size, target, distance, fovY }) => {
  const canvas = makeCanvas(size);
  const camera = new Camera();
  const player = await Player.create(canvas, { backend: "webgl2" });
  const { pose, avatar } = player.add(await load(url));
  const joints = avatar.skeleton?.names ?? [];
  const neck = joints[Math.min(1, joints.length - 1)];
  return {
    canvas,
    draw(i) {
      const at = still ? 0 : i;
      pose.expressionWeights.forEach((_, k) => (pose.expressionWeights[k] = 0.1 + 0.1 * Math.sin(0.2 * at + k)));
      if (neck !== undefined) pose.setJoint(neck, 0, 0.05 * Math.sin(0.3 * at), 0);
      camera.orbit(target, distance, yawOf(i), 0, fovY, size, size);
      player.frame(camera, WHITE);
      return player.finished();
    },
  };
}, 0);
