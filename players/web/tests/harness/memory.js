// What runs in the page of memory.test.mjs.

import { Camera } from "../../src/camera.ts";
import { load } from "../../src/load.ts";
import { Player } from "../../src/player.ts";
import { drivingFrame } from "../../src/pose/arkit.ts";
import { Clip } from "../../src/pose/clip.ts";
import { Driver } from "../../src/pose/driver.ts";
import { alive, countGpu } from "./counted.js";

const camera = new Camera();
const frame = drivingFrame();
const light = { ambient: [0.2, 0.2, 0.2], lights: [{ direction: [0, 1, 2], colour: [1, 1, 1] }, { position: [1, 1, 1], colour: [1, 1, 1] }], shadow: true };
let player, instance, driver, clip;

async function start(backend, file) {
  countGpu(backend);
  player = await Player.create(null, { backend });
  const avatar = await load(file);
  instance = player.add(avatar);
  driver = new Driver(avatar);
  clip = new Clip(avatar, 0);
}

/** Draws pose and camera by number. */
async function draw(ofPose, ofCamera, size) {
  const { expressionWeights, jointDelta } = instance.pose;
  frame.weights.fill(0.5);
  driver.pose(frame, instance.pose);
  clip.pose(ofPose / 3001, instance.pose);
  for (let k = 0; k < expressionWeights.length; k++) expressionWeights[k] = 0.3 * Math.sin(0.1 * ofPose + k);
  if (jointDelta.length > 0) jointDelta[3] = 0.01 * Math.sin(0.1 * ofPose);
  const { target, size: extent } = instance.avatar.framing.whole;
  if (instance.avatar.relight !== null) {
    light.lights[0].direction[0] = Math.sin(ofPose);
    player.light = light;
  }
  camera.orbit(target, 1.5 * Math.max(extent[0], extent[1], extent[2]), 0.5 * Math.sin(ofCamera), 0, 0.8, size, size);
  player.frame(camera, null);
  await player.finished();
}

/** `n` frames with a new pose and camera each; returns how many GPU objects live. */
async function frames(n) {
  for (let i = 0; i < n; i++) await draw(i, i, 64);
  return { ...alive };
}

/** Loads, draws and disposes of `n` avatars; returns how many GPU objects live. */
async function loads(file, n) {
  for (let i = 0; i < n; i++) {
    const other = player.add(await load(file));
    player.frame(camera, null);
    await player.finished();
    other.dispose();
  }
  return frames(1);
}

/** Frees the player; returns how many GPU objects live. */
function dispose() {
  player.dispose();
  return { ...alive };
}

/** The image of a pose and a camera, small. */
async function image(ofPose, ofCamera) {
  await draw(ofPose, ofCamera, 48);
  return (await player.readPixels()).join(" ");
}

/** Two poses in turn, each read while the next frame is under way: how many of `n` images are not the first of their pose. */
async function misread(n) {
  const first = [];
  let others = 0;
  for (let i = 0; i < n; i++) {
    await draw(700 * (i % 2), 1, 128);
    player.frame(camera, null);
    const now = (await player.readPixels()).join(" ");
    if (now !== (first[i % 2] ??= now)) others++;
  }
  return first[0] === first[1] ? n : others;
}

Object.assign(window, { start, frames, loads, dispose, image, misread });
