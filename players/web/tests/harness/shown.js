// What runs in the page of shown.test.mjs.
import { Camera } from "../../src/camera.ts";
import { load } from "../../src/load.ts";
import { Player } from "../../src/player.ts";

const SIZE = 256;
const BACKGROUND = [0.2, 0.4, 0.6];
let player;

window.show = async (file) => {
  document.body.style.margin = "0";
  const canvas = document.createElement("canvas");
  document.body.append(canvas);
  player = await Player.create(canvas, { backend: "webgpu" });
  const { avatar } = player.add(await load(file));
  const { target, size } = avatar.framing.whole;
  const camera = new Camera();
  camera.orbit(target, 2 * Math.max(...size), 0.2, 0.1, 0.6, SIZE, SIZE);
  player.frame(camera, BACKGROUND);
  await player.finished();
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))); // it is on the screen
};

/** The largest difference, in bytes, of a picture of the page from what the player reads back; the share covered. */
window.compare = async (png) => {
  const bytes = Uint8Array.from(atob(png), (character) => character.charCodeAt(0));
  const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
  const context = new OffscreenCanvas(SIZE, SIZE).getContext("2d");
  context.drawImage(bitmap, 0, 0);
  const shown = context.getImageData(0, 0, SIZE, SIZE).data;
  const read = await player.readPixels();
  let most = 0, covered = 0;
  for (let at = 0; at < shown.length; at += 4) {
    const alpha = read[at + 3];
    if (alpha > 0.5) covered++;
    for (let c = 0; c < 3; c++) {
      const want = 255 * Math.min(1, read[at + c] + (1 - alpha) * BACKGROUND[c]);
      most = Math.max(most, Math.abs(shown[at + c] - want));
    }
  }
  return { most, covered: covered / (SIZE * SIZE) };
};
