// Recorded motions: float32, or by channel low + step * code with codes as differences from frame to frame.

import type { ClipData } from "../avatar.js";
import { AvatarError } from "../errors.js";
import type { AvatarText } from "./document.js";
import { checkFinite, hasAffineRow, volume } from "./rig.js";
import type { HeldArray } from "./tensors.js";

const RIGID = 1e-3; // largest difference of R R^T from the identity

type Arrays = ReadonlyMap<string, HeldArray>;

/** How many expressions, late morphs and joints an avatar has. */
export interface Sizes {
  readonly expressions: number;
  readonly late: number;
  readonly joints: number;
}

/** The clips of a document; all of them together take at most `limit` bytes. Throws AvatarError. */
export function readClips({ clips }: AvatarText, arrays: Arrays, sizes: Sizes, limit: number): ClipData[] {
  let left = limit;
  return clips.map(({ name, fps, frames }, index) => {
    const path = `$.avatar.clips[${index}]`;
    const array = (name: string, shape: readonly number[]): Float32Array => {
      const channels = shape.reduce((product, length) => product * length, 1);
      left -= 4 * frames * channels;
      if (left < 0) throw new AvatarError(`with it the clips take more than ${limit} bytes`, { field: path });
      const values = readArray(arrays, `clips.${index}.${name}`, frames, shape, channels);
      checkFinite(values, `array clips.${index}.${name}`);
      return values;
    };
    const clip = {
      name,
      fps,
      frames,
      expressionWeights: array("expression_weights", [sizes.expressions]),
      lateWeights: array("late_weights", [sizes.late]),
      jointDelta: array("joint_delta", [sizes.joints, 4, 4]),
      worldFromAvatar: array("world_from_avatar", [4, 4]),
    };
    checkMatrices(clip, path);
    return clip;
  });
}

function readArray(
  arrays: Arrays,
  key: string,
  frames: number,
  shape: readonly number[],
  channels: number,
): Float32Array {
  const whole = arrays.get(key);
  if (whole !== undefined) {
    const wanted = [frames, ...shape];
    if (!(whole.values instanceof Float32Array) || String(whole.shape) !== String(wanted)) {
      const message = `has shape [${whole.shape.join(", ")}], not [${wanted.join(", ")}]`;
      throw new AvatarError(message, { field: `array ${key}` });
    }
    return whole.values;
  }
  const scale = arrays.get(`${key}.scale`);
  if (!(scale?.values instanceof Float32Array) || String(scale.shape) !== String([channels, 2])) {
    throw new AvatarError(`is missing, or is not float32 [${channels}, 2]`, { field: `array ${key}.scale` });
  }
  const moves = moving(scale.values);
  const codes = arrays.get(`${key}.codes`);
  if (!(codes?.values instanceof Uint16Array) || String(codes.shape) !== String([moves.length, frames])) {
    throw new AvatarError(`is missing, or is not uint16 [${moves.length}, ${frames}]`, { field: `array ${key}.codes` });
  }
  return decoded(scale.values, moves, codes.values, frames, channels);
}

/** Channels that are not the same throughout. */
function moving(scale: Float32Array): number[] {
  const found: number[] = [];
  for (let channel = 0; 2 * channel < scale.length; channel++) {
    if (scale[2 * channel + 1] !== 0) found.push(channel);
  }
  return found;
}

function decoded(
  scale: Float32Array,
  moves: readonly number[],
  codes: Uint16Array,
  frames: number,
  channels: number,
): Float32Array {
  const values = new Float32Array(frames * channels);
  for (let at = 0; at < values.length; at += channels) {
    for (let channel = 0; channel < channels; channel++) values[at + channel] = scale[2 * channel] as number;
  }
  moves.forEach((channel, row) => {
    const low = scale[2 * channel] as number;
    const step = scale[2 * channel + 1] as number;
    let code = 0;
    for (let frame = 0; frame < frames; frame++) {
      code = (code + (codes[row * frames + frame] as number)) & 0xffff;
      values[frame * channels + channel] = low + Math.fround(code * step);
    }
  });
  return values;
}

function checkMatrices(clip: ClipData, field: string): void {
  for (const matrices of [clip.jointDelta, clip.worldFromAvatar]) {
    for (let at = 0; at < matrices.length; at += 16) {
      if (!hasAffineRow(matrices, at)) throw new AvatarError("holds a matrix that is not affine", { field });
    }
  }
  for (let at = 0; at < clip.worldFromAvatar.length; at += 16) {
    if (!isRigid(clip.worldFromAvatar, at)) {
      const needed = "a rotation and a translation move the avatar as a whole";
      throw new AvatarError(`world_from_avatar of frame ${at / 16} is not rigid: ${needed}`, { field });
    }
  }
}

function isRigid(m: Float32Array, at: number): boolean {
  let off = 0;
  for (let i = 0; i < 3; i++) {
    for (let j = 0; j < 3; j++) {
      let dot = i === j ? -1 : 0;
      for (let k = 0; k < 3; k++) dot += (m[at + 4 * i + k] as number) * (m[at + 4 * j + k] as number);
      off = Math.max(off, Math.abs(dot));
    }
  }
  return off <= RIGID && volume(m, at) > 0;
}
