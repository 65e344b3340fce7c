import type { Avatar, Driving, Skeleton } from "../avatar.js";
import { AvatarError } from "../errors.js";
import { invertLinear, multiplyLinear, setFromQuat, setRotation } from "./affine.js";
import { ARKIT_NAMES, type DrivingFrame, RADIANS_PER_EYE_WEIGHT } from "./arkit.js";
import { restOf } from "./chain.js";
import { eigen } from "./eigen.js";
import type { Pose } from "./pose.js";

const MOST_CONDITION = 1e6; // of the linear part of a joint's rest transform
const HEAD_SIGNS = [1, -1, 1] as const; // of yaw, pitch, roll about +Y, +X, +Z
const EYE_SIGNS = [-1, 1, -1] as const;
const MIRROR = [-1, 1, -1] as const; // of the same angles in a left-handed frame

/** Options of a Driver. */
export interface DriverOptions {
  /** Limits each expression to its trained range and each eyelid to 0..1. By default weights are used as they come. */
  readonly withinRange?: boolean;
}

/** Makes poses of one avatar from captured frames: ARKit weights, rotations of head and eyes. */
export class Driver {
  private readonly driving: Driving;
  private readonly columns: Int32Array; // input -> place in ARKIT_NAMES; -1: it stays 0
  private readonly values: Float64Array; // [outputs]
  private readonly weights: readonly Weight[];
  private readonly turns: readonly Turn[];
  private readonly head: Turn | null;
  private readonly leftEye: Turn | null;
  private readonly rightEye: Turn | null;
  private readonly rotation = new Float64Array(12); // the rotation in hand, rows four apart
  private readonly made = new Float64Array(12);
  private readonly angles = new Float64Array(3);
  private readonly quat = new Float64Array(4);
  private readonly mirrored: boolean;

  /** Throws AvatarError if ARKit cannot drive this avatar, and for a joint that cannot turn. */
  constructor(avatar: Avatar, options: DriverOptions = {}) {
    const driving = avatar.driving;
    if (driving === null) {
      throw new AvatarError("ARKit weights cannot drive this avatar: no mapping from the 52 ARKit names is known", {
        owner: avatar.name,
        field: "driving",
      });
    }
    this.driving = driving;
    this.mirrored = avatar.handedness === "left";
    this.columns = Int32Array.from(driving.inputs, (name) => ARKIT_NAMES.indexOf(name));
    this.values = new Float64Array(driving.outputs.length);
    this.weights = weightsOf(avatar, driving, options.withinRange ?? false);
    const { skeleton } = avatar;
    const turns = skeleton === null ? [] : turnsOf(avatar.name, skeleton, driving);
    const turn = (joint: string | null): Turn | null => turns.find((one) => one.name === joint) ?? null;
    this.turns = turns;
    this.head = turn(driving.headJoint);
    this.leftEye = turn(driving.leftEyeJoint);
    this.rightEye = turn(driving.rightEyeJoint);
  }

  /** Writes the pose of a frame into `out`, a pose of this avatar. What the frame does not move is at rest. */
  pose(frame: DrivingFrame, out: Pose): void {
    out.reset();
    this.multiply(frame.weights);
    for (let i = 0; i < this.weights.length; i++) {
      const one = this.weights[i] as Weight;
      const weight = Math.min(Math.max(this.values[one.row] as number, one.low), one.high);
      (one.late ? out.lateWeights : out.expressionWeights)[one.column] = weight;
    }
    for (let i = 0; i < this.turns.length; i++) this.turnJoint(this.turns[i] as Turn, frame, out);
    if (this.head === null) this.turnWhole(frame, out);
  }

  private multiply(weights: Float32Array): void {
    const { matrix } = this.driving;
    const inputs = this.columns.length;
    for (let row = 0; row < this.values.length; row++) {
      let sum = 0;
      for (let i = 0; i < inputs; i++) {
        const column = this.columns[i] as number;
        sum += column < 0 ? 0 : (matrix[row * inputs + i] as number) * (weights[column] as number);
      }
      this.values[row] = sum;
    }
  }

  /** The delta B^-1 R B of a joint with the rotation R that matrix, eyes and head give it. */
  private turnJoint(turn: Turn, frame: DrivingFrame, out: Pose): void {
    let turned = turn.fromMatrix;
    if (turned) {
      for (let axis = 0; axis < 3; axis++) {
        const row = turn.rows[axis] as number;
        this.angles[axis] = row < 0 ? 0 : (this.values[row] as number);
      }
      setRotation(this.rotation, 0, this.angles, 0);
    }
    if (turn === this.leftEye) turned = this.turnEye(frame.rightEye, frame.weights, LOOK_LEFT, turned);
    if (turn === this.rightEye) turned = this.turnEye(frame.leftEye, frame.weights, LOOK_RIGHT, turned);
    if (turn === this.head) {
      this.setEuler(turned ? this.made : this.rotation, frame.head, HEAD_SIGNS);
      if (turned) multiplyLinear(this.rotation, 0, this.made, 0, this.rotation, 0);
    }
    multiplyLinear(this.rotation, 0, this.rotation, 0, turn.rest, 0);
    multiplyLinear(out.jointDelta, 16 * turn.joint, turn.inverse, 0, this.rotation, 0);
  }

  /** A measured eye replaces what turned it; one that nothing turned follows the weights. The result is true. */
  private turnEye(measured: Float64Array, weights: Float32Array, look: Look, turned: boolean): boolean {
    if (measured[0] !== 0 || measured[1] !== 0 || measured[2] !== 0) {
      this.setEuler(this.rotation, measured, EYE_SIGNS);
    } else if (!turned) {
      this.angles[0] = RADIANS_PER_EYE_WEIGHT * ((weights[look.right] as number) - (weights[look.left] as number));
      this.angles[1] = RADIANS_PER_EYE_WEIGHT * ((weights[look.down] as number) - (weights[look.up] as number));
      this.angles[2] = 0;
      this.setEuler(this.rotation, this.angles, EYE_SIGNS);
    }
    return true;
  }

  /** The whole avatar turns about the head's pivot: X = T(p) H T(-p). */
  private turnWhole(frame: DrivingFrame, out: Pose): void {
    const m = out.worldFromAvatar;
    this.setEuler(m, frame.head, HEAD_SIGNS);
    const [x, y, z] = this.driving.headPivot;
    m[3] = x - (m[0] as number) * x - (m[1] as number) * y - (m[2] as number) * z;
    m[7] = y - (m[4] as number) * x - (m[5] as number) * y - (m[6] as number) * z;
    m[11] = z - (m[8] as number) * x - (m[9] as number) * y - (m[10] as number) * z;
  }

  /** Ry Rx Rz of signed angles (yaw, pitch, roll), in the frame of the avatar. */
  private setEuler(into: Float64Array, angles: Float64Array, signs: readonly [number, number, number]): void {
    const a = ((angles[0] as number) * signs[0] * (this.mirrored ? MIRROR[0] : 1)) / 2;
    const b = ((angles[1] as number) * signs[1] * (this.mirrored ? MIRROR[1] : 1)) / 2;
    const c = ((angles[2] as number) * signs[2] * (this.mirrored ? MIRROR[2] : 1)) / 2;
    const ca = Math.cos(a), sa = Math.sin(a), cb = Math.cos(b), sb = Math.sin(b), cc = Math.cos(c), sc = Math.sin(c);
    this.quat[0] = ca * cb * cc + sa * sb * sc; // of Ry(2a) Rx(2b) Rz(2c)
    this.quat[1] = ca * sb * cc + sa * cb * sc;
    this.quat[2] = sa * cb * cc - ca * sb * sc;
    this.quat[3] = ca * cb * sc - sa * sb * cc;
    setFromQuat(into, 0, this.quat, 0);
  }
}

/** Places of the eyeLook weights of one eye, by where it looks to. */
interface Look {
  readonly right: number; // the subject's
  readonly left: number;
  readonly up: number;
  readonly down: number;
}

const LOOK_LEFT = lookOf("Left", "In", "Out");
const LOOK_RIGHT = lookOf("Right", "Out", "In");

function lookOf(side: string, right: string, left: string): Look {
  const at = (way: string): number => ARKIT_NAMES.indexOf(`eyeLook${way}${side}`);
  return { right: at(right), left: at(left), up: at("Up"), down: at("Down") };
}

/** A weight that an output gives. */
interface Weight {
  readonly row: number; // of the matrix
  readonly late: boolean;
  readonly column: number; // of the pose's weights
  readonly low: number;
  readonly high: number;
}

function weightsOf(avatar: Avatar, driving: Driving, withinRange: boolean): Weight[] {
  const found: Weight[] = [];
  const expressions = new Map(avatar.expressions.map(({ name }, column) => [name, column]));
  const eyelids = new Map(avatar.eyelids.map((name, column) => [name, column]));
  driving.outputs.forEach((output, row) => {
    const slash = output.indexOf("/");
    const kind = output.slice(0, slash);
    const name = output.slice(slash + 1);
    if (kind === "expression") {
      const column = expressions.get(name) ?? -1;
      const [low, high] = withinRange ? (avatar.expressions[column]?.range ?? [0, 0]) : [-Infinity, Infinity];
      found.push({ row, late: false, column, low, high });
    } else if (kind === "eyelid") {
      const [low, high] = withinRange ? [0, 1] : [-Infinity, Infinity];
      found.push({ row, late: true, column: eyelids.get(name) ?? -1, low, high });
    }
  });
  return found;
}

/** A joint that driving turns. */
interface Turn {
  readonly name: string;
  readonly joint: number;
  readonly fromMatrix: boolean;
  readonly rows: Int32Array; // of the matrix, for the axes x, y, z; -1: none
  readonly rest: Float64Array; // [3, 4] linear part of mesh_from_joint at rest
  readonly inverse: Float64Array;
}

/** The joints that the matrix, the head or the eyes turn. Throws AvatarError if any joint cannot turn. */
function turnsOf(owner: string, skeleton: Skeleton, driving: Driving): Turn[] {
  const rest = restOf(skeleton);
  const found: Turn[] = [];
  const outputs = new Map(driving.outputs.map((name, row) => [name, row]));
  skeleton.names.forEach((name, joint) => {
    const own = rest.slice(12 * joint, 12 * joint + 12);
    if (!(condition(own) < MOST_CONDITION)) {
      throw new AvatarError("has a singular rest transform, so it cannot turn", { owner, field: `joint ${name}` });
    }
    const rows = Int32Array.from(["x", "y", "z"], (axis) => outputs.get(`joint/${name}/${axis}`) ?? -1);
    const fromMatrix = rows.some((row) => row >= 0);
    if (fromMatrix || [driving.headJoint, driving.leftEyeJoint, driving.rightEyeJoint].includes(name)) {
      const inverse = new Float64Array(12);
      invertLinear(inverse, 0, own, 0);
      found.push({ name, joint, fromMatrix, rows, rest: own, inverse });
    }
  });
  return found;
}

/** The ratio of the largest and the least singular value of a 3x3 part, rows four apart. */
function condition(m: Float64Array): number {
  const square = new Float64Array(9);
  for (let i = 0; i < 9; i++) {
    const row = Math.floor(i / 3), column = i % 3;
    for (let k = 0; k < 12; k += 4) {
      square[i] = (square[i] as number) + (m[k + row] as number) * (m[k + column] as number);
    }
  }
  const largest = eigen(square, new Float64Array(9), 3);
  const values = [square[0] as number, square[4] as number, square[8] as number];
  return Math.sqrt((values[largest] as number) / Math.max(Math.min(...values), 0));
}
