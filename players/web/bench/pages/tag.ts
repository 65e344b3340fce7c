// The element, as a page has it: a camera that moves; with ?idle it lives, too.

import "../../src/element.js";
import type { GaussianAvatarElement } from "../../src/element.js";
import type { Stage } from "../../src/stage/stage.js";
import { offer, steppedAnimation, yawOf } from "./common.js";

const FRAME_MS = 33;
const TAN_HALF_FOV = Math.tan(Math.PI / 12); // of the element's camera
const animation = steppedAnimation();
const idle = new URLSearchParams(location.search).has("idle");

offer(async ({ url, size, distance, fovY }) => {
  const element = document.createElement("gaussian-avatar") as GaussianAvatarElement;
  element.style.cssText = `width:${size}px;background:#fff`;
  for (const [name, value] of Object.entries({ src: url, backend: "webgl2", level: "0", idle: idle ? "on" : "off" })) element.setAttribute(name, value);
  let loaded = false;
  element.addEventListener("load", () => (loaded = true));
  document.body.append(element);
  for (let now = 0; !loaded; now += FRAME_MS) {
    await new Promise((done) => setTimeout(done, FRAME_MS));
    animation.run(now);
  }
  const stage = (element as unknown as { stage: Stage }).stage;
  return {
    canvas: stage.element,
    draw(i) {
      stage.orbit.distance = (distance * Math.tan(fovY / 2)) / TAN_HALF_FOV;
      stage.orbit.yaw = yawOf(i);
      stage.ask();
      animation.run(performance.now());
      return stage.player?.finished();
    },
  };
});
