// node tests/judge.mjs: what the player makes of packs. In: for each, its bytes behind their number (u32). Out: a line of JSON.
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { crc32 } from "node:zlib";
import { imported } from "../bundle.mjs";

const core = await imported({ entryPoints: [join(dirname(fileURLToPath(import.meta.url)), "core/internals.ts")] });
const AXIS = [1, 2, 3].map((part) => part / Math.sqrt(14));
const bytesOf = ({ buffer, byteOffset, byteLength }) => new Uint8Array(buffer, byteOffset, byteLength);

/** The checksum of texts and arrays, one after the other, in eight hexadecimal digits. */
function sum(parts) {
  let found = 0;
  for (const part of parts) if (part.length > 0) found = crc32(typeof part === "string" ? part : bytesOf(part), found); // of nothing, it gives 0
  return found.toString(16).padStart(8, "0");
}

function buffersOf({ program }) {
  const packed = [...program.buffers.values()].filter(({ sections }) => sections.length > 0);
  return packed.flatMap((buffer) => [buffer.name, core.contentOf(buffer)]);
}

function arraysOf({ skeleton, preview, ...avatar }) {
  const own = [];
  if (skeleton !== null) {
    own.push(skeleton.parents);
    for (const name of ["restLocal", "inverseBindMatrix", "jointBasis"]) own.push(Float32Array.from(skeleton[name]));
    own.push(skeleton.correctiveJoints, skeleton.anchorVertices, trianglesOf(avatar));
  }
  return preview === null ? own : [...own, preview];
}

/** Triangles [F, 3] of [3, F]. */
function trianglesOf({ triangles, program }) {
  const passes = program.levels.flatMap(({ deform }) => deform);
  const bound = passes.find(({ buffers }) => "SurfaceStatic" in buffers)?.buffers.SurfaceStatic;
  const corners = triangles ?? program.buffers.get(bound).sections.find(({ name }) => name === "corners").elements;
  const count = corners.length / 3;
  return Uint32Array.from(corners, (_, i) => corners[(i % 3) * count + Math.floor(i / 3)]);
}

function clipsOf({ clips }) {
  return clips.flatMap(({ name, fps, frames, ...arrays }) => {
    const { expressionWeights, lateWeights, jointDelta, worldFromAvatar } = arrays;
    return [name, Float64Array.of(fps), Uint32Array.of(frames), expressionWeights, lateWeights, jointDelta, worldFromAvatar];
  });
}

/** Whether the joints that ARKit turns can turn. */
function drives(avatar) {
  try {
    return Boolean(new core.Driver(avatar));
  } catch (error) {
    if (error instanceof core.AvatarError) return false;
    throw error;
  }
}

/** Poses by name: each sets a pose that is at rest. */
const POSES = {
  rest() {},
  named(pose, { expressions, eyelids, skeleton }) {
    expressions.forEach(({ name }, k) => pose.setExpression(name, 0.1 * (k % 7)));
    eyelids.forEach((name, l) => pose.setEyelid(name, 0.1 * (l % 7)));
    skeleton?.names.forEach((name, j) => pose.setJoint(name, ...AXIS.map((part) => 0.05 * (j % 5) * part)));
  },
  driven(pose, avatar) {
    if (avatar.driving === null || !drives(avatar)) return;
    const frame = core.drivingFrame();
    avatar.driving.inputs.forEach((name, i) => {
      const channel = core.ARKIT_NAMES.indexOf(name);
      if (channel >= 0) frame.weights[channel] = 0.1 * ((i % 9) + 1);
    });
    new core.Driver(avatar).pose(frame, pose);
  },
  clip(pose, avatar) {
    if (avatar.clips.length === 0) return;
    const clip = new core.Clip(avatar, 0);
    clip.pose(0.37 * clip.seconds, pose);
  },
};

async function verdict(file) {
  try {
    const avatar = await core.load(file, { name: "pack" });
    const poser = new core.Poser(avatar);
    const pose = new core.Pose(avatar);
    const poses = {};
    for (const [name, set] of Object.entries(POSES)) {
      pose.reset();
      set(pose, avatar);
      poses[name] = Buffer.from(bytesOf(poser.update(pose).poseFloats)).toString("base64");
    }
    return { ok: true, buffers: sum(buffersOf(avatar)), arrays: sum(arraysOf(avatar)), clips: sum(clipsOf(avatar)), poses };
  } catch (error) {
    if (!(error instanceof core.AvatarError)) throw error;
    return { ok: false, why: error.message };
  }
}

let waiting = Buffer.alloc(0);
for await (const piece of process.stdin) {
  waiting = waiting.length === 0 ? piece : Buffer.concat([waiting, piece]);
  let lines = "";
  while (waiting.length >= 4 && waiting.length >= 4 + waiting.readUInt32LE(0)) {
    const end = 4 + waiting.readUInt32LE(0);
    lines += `${JSON.stringify(await verdict(Uint8Array.from(waiting.subarray(4, end))))}\n`;
    waiting = waiting.subarray(end);
  }
  if (lines !== "") process.stdout.write(lines);
}
