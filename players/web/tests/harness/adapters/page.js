// Plays scenes in one engine, and posts their pictures to the server.

import { load } from "../../../src/load.ts";
import { makeStage } from "stage";

const actors = [];
let stage;
let avatar; // that was added last
let announced = false; // a newer picture, by the engine's own event

/** Draws until the worker has nothing newer. */
async function picture() {
  do {
    stage.newer = false;
    stage.draw();
    await stage.finished();
    announced ||= stage.newer;
  } while (stage.newer);
  stage.draw();
  stage.drawn?.();
  return stage.read();
}

const post = (name, body) => fetch(`/out/${name}`, { method: "POST", body });

/** Posts what `run` throws. */
async function refusal(name, run) {
  const said = await Promise.resolve().then(run).then(() => "nothing", String);
  await post(name, said);
}

const STEPS = {
  add: async (file, level) => void actors.push(stage.add((avatar = await load(file)), level)),
  place: (actor, x, y, z, yaw, scale) => actors[actor].place(x, y, z, yaw, scale),
  show: (actor, visible) => actors[actor].show(visible),
  attach: (actor, attached) => actors[actor].attach(attached),
  clone: (actor) => void actors.push(actors[actor].clone()),
  dispose: (actor) => actors[actor].dispose(),
  lit: (actor, name) => post(name, JSON.stringify(actors[actor].lit())),
  pose: (actor, said) => actors[actor].pose(said),
  floor: (z) => stage.floor(z),
  light: (actor, light) => actors[actor].light(light),
  lamps: (list) => stage.lamps(list),
  ball: (on) => stage.ball(on),
  seen: (actor, name) => post(name, JSON.stringify(actors[actor].seen())),
  part: (x, y, size) => stage.part(x, y, size),
  wall: (z) => stage.wall(z),
  pane: (z) => stage.pane(z),
  dense: (z, name) => post(name, JSON.stringify(stage.dense(z))),
  announced: (name) => post(name, String(announced)),
  picture: async (name) => post(name, await picture()),
  glance: async (name) => {
    stage.draw();
    stage.drawn?.();
    await post(name, await stage.read());
  },
  lose: () => stage.lose(),
  orthographic: async (name) => {
    stage.orthographic(true);
    await refusal(name, picture);
    stage.orthographic(false);
  },
  addLevel: (level, name) => refusal(name, () => stage.add(avatar, level)),
  disposeAvatars: () => stage.disposeAvatars(),
};

/** Runs the steps of a scene, each a function of STEPS and its values. Returns the errors of the graphics interface. */
async function play(options, steps) {
  stage = await makeStage(options);
  const found = [];
  for (const [what, ...values] of steps) {
    await STEPS[what](...values);
    found.push(...(await stage.errors()).map((error) => `${what}: ${error}`));
  }
  return found;
}

Object.assign(window, { play });
