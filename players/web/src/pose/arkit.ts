// The 52 ARKit blendshape names and the nine rotation channels that Live Link Face sends after them.
// Left and right are the subject's, except in the names of the eye channels.

/** ARKit's names, in the order of a Live Link Face packet. */
export const ARKIT_NAMES: readonly string[] = (
  "eyeBlinkLeft eyeLookDownLeft eyeLookInLeft eyeLookOutLeft eyeLookUpLeft eyeSquintLeft eyeWideLeft eyeBlinkRight " +
  "eyeLookDownRight eyeLookInRight eyeLookOutRight eyeLookUpRight eyeSquintRight eyeWideRight jawForward jawRight " +
  "jawLeft jawOpen mouthClose mouthFunnel mouthPucker mouthRight mouthLeft mouthSmileLeft mouthSmileRight " +
  "mouthFrownLeft mouthFrownRight mouthDimpleLeft mouthDimpleRight mouthStretchLeft mouthStretchRight mouthRollLower " +
  "mouthRollUpper mouthShrugLower mouthShrugUpper mouthPressLeft mouthPressRight mouthLowerDownLeft mouthLowerDownRight " +
  "mouthUpperUpLeft mouthUpperUpRight browDownLeft browDownRight browInnerUp browOuterUpLeft browOuterUpRight cheekPuff " +
  "cheekSquintLeft cheekSquintRight noseSneerLeft noseSneerRight tongueOut"
).split(" ");

/** All 61 channels: ARKIT_NAMES, then yaw, pitch and roll of head, leftEye and rightEye. */
export const CHANNELS: readonly string[] = [
  ...ARKIT_NAMES,
  ...["head", "leftEye", "rightEye"].flatMap((part) => ["Yaw", "Pitch", "Roll"].map((angle) => part + angle)),
];

/** Rotation of an eye by one unit of an eyeLook weight. */
export const RADIANS_PER_EYE_WEIGHT = 0.609;

/** A captured frame of a face. */
export interface DrivingFrame {
  /** Weights, [52], in the order of ARKIT_NAMES. They may lie below 0 or above 1. */
  readonly weights: Float32Array;
  /** Yaw, pitch and roll of the head, radians, [3]. */
  readonly head: Float64Array;
  /** Yaw, pitch and roll of the recorder's channels leftEye*, radians, [3]: the subject's right eye. */
  readonly leftEye: Float64Array;
  /** Those of the channels rightEye*, [3]: the subject's left eye. */
  readonly rightEye: Float64Array;
}

/** A frame of zeros, to be written again and again. */
export function drivingFrame(): DrivingFrame {
  return {
    weights: new Float32Array(ARKIT_NAMES.length),
    head: new Float64Array(3),
    leftEye: new Float64Array(3),
    rightEye: new Float64Array(3),
  };
}

/** Writes 61 channels, in the order of CHANNELS, that begin at channels[at] into a frame. */
export function setChannels(frame: DrivingFrame, channels: ArrayLike<number>, at = 0): void {
  const shapes = ARKIT_NAMES.length;
  for (let i = 0; i < shapes; i++) frame.weights[i] = channels[at + i] as number;
  for (let i = 0; i < 3; i++) {
    frame.head[i] = channels[at + shapes + i] as number;
    frame.leftEye[i] = channels[at + shapes + 3 + i] as number;
    frame.rightEye[i] = channels[at + shapes + 6 + i] as number;
  }
}

/**
 * The channel that a name spells, or null. Case, underscores, prefixes of tools ("BS_node.", "AK_01_"), "_L" and "_R"
 * for Left and Right, and the halves of browInnerUp and cheekPuff are understood.
 */
export function channelOf(name: string): string | null {
  const last = name.trim().split(/[.:|/]/).pop() ?? "";
  const plain = last.toLowerCase().replace(/^(ak_[0-9]+|arkit|bs)_/, "").replace(/[_\- ]/g, "");
  return SPELLINGS.get(plain) ?? null;
}

const SPELLINGS = spellings();

function spellings(): ReadonlyMap<string, string> {
  const table = new Map(CHANNELS.map((name) => [name.toLowerCase(), name]));
  for (const name of ARKIT_NAMES) {
    const short = name.replace(/Left$/, "L").replace(/Right$/, "R");
    table.set(short.toLowerCase(), name);
  }
  for (const whole of ["browInnerUp", "cheekPuff"]) {
    for (const side of ["l", "r", "left", "right"]) table.set(whole.toLowerCase() + side, whole);
  }
  return table;
}
