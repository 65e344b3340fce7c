import type { Avatar } from "../avatar.js";
import { AvatarError, noSuch } from "../errors.js";
import { setIdentity, setRotation } from "./affine.js";

const MOST_WEIGHT = 3.4028234663852886e38; // float32
const VECTOR = new Float64Array(3);

/**
 * A pose of one avatar. Its arrays are in the frame of the pack and may be written directly; what goes by name is
 * right-handed for every pack. No method allocates.
 */
export class Pose {
  /** Weights of the expressions, [K], in the avatar's order. */
  readonly expressionWeights: Float32Array;
  /** Weights of the late morphs (eyelids), [L]. */
  readonly lateWeights: Float32Array;
  /** parent_from_joint = rest_local delta, [J, 4, 4] row-major: affine matrices, whose last row is not read. */
  readonly jointDelta: Float64Array;
  /** Rigid transform of the posed avatar as a whole, [4, 4] row-major. */
  readonly worldFromAvatar = new Float64Array(16);
  private readonly names: Names;
  private readonly side: 1 | -1; // a rotation vector keeps x in a mirror

  constructor(avatar: Avatar) {
    this.side = avatar.handedness === "left" ? -1 : 1;
    this.names = namesOf(avatar);
    this.expressionWeights = new Float32Array(avatar.expressions.length);
    this.lateWeights = new Float32Array(avatar.eyelids.length);
    this.jointDelta = new Float64Array(16 * this.names.joints.size);
    this.reset();
  }

  /** Back to rest: weights 0, joints and the whole avatar unmoved. */
  reset(): void {
    this.expressionWeights.fill(0);
    this.lateWeights.fill(0);
    for (let at = 0; at < this.jointDelta.length; at += 16) setIdentity(this.jointDelta, at, 4);
    setIdentity(this.worldFromAvatar, 0, 4);
  }

  /** Takes over all values of `other`, a pose of the same avatar. */
  copy(other: Pose): void {
    this.expressionWeights.set(other.expressionWeights);
    this.lateWeights.set(other.lateWeights);
    this.jointDelta.set(other.jointDelta);
    this.worldFromAvatar.set(other.worldFromAvatar);
  }

  /** Sets an expression by its name or an alias. Throws AvatarError for an unknown name and a weight beyond float32. */
  setExpression(name: string, weight: number): void {
    const index = indexOf("expression of this avatar", name, this.names.expressions, this.names.listed);
    this.expressionWeights[index] = finite("expression", name, weight);
  }

  /** Sets an eyelid or another late morph by name. Throws AvatarError as `setExpression`. */
  setEyelid(name: string, weight: number): void {
    const index = indexOf("eyelid of this avatar", name, this.names.late);
    this.lateWeights[index] = finite("eyelid", name, weight);
  }

  /**
   * Turns a joint by a rotation vector (axis times angle, radians) in the joint's rest frame, right-handed: the same
   * vector shows the same for packs of both handednesses. Its own translation and scale are reset. Throws AvatarError
   * for an unknown name and an angle that is not finite.
   */
  setJoint(name: string, rx: number, ry: number, rz: number): void {
    const at = 16 * indexOf("joint of this avatar", name, this.names.joints);
    finite("joint", name, rx + ry + rz);
    setIdentity(this.jointDelta, at, 4);
    VECTOR[0] = rx;
    VECTOR[1] = this.side * ry;
    VECTOR[2] = this.side * rz;
    setRotation(this.jointDelta, at, VECTOR, 0);
  }

  /** Writes the rotation vector of a joint into `out` [3], as `setJoint` takes it. Throws AvatarError as it does. */
  readJoint(name: string, out: Float64Array): void {
    const m = this.jointDelta;
    const at = 16 * indexOf("joint of this avatar", name, this.names.joints);
    const x = (m[at + 9] as number) - (m[at + 6] as number);
    const y = (m[at + 2] as number) - (m[at + 8] as number);
    const z = (m[at + 4] as number) - (m[at + 1] as number);
    const sine = Math.hypot(x, y, z) / 2;
    const cosine = ((m[at] as number) + (m[at + 5] as number) + (m[at + 10] as number) - 1) / 2;
    const scale = sine > 1e-12 ? Math.atan2(sine, cosine) / (2 * sine) : 0.5;
    out[0] = x * scale;
    out[1] = this.side * y * scale;
    out[2] = this.side * z * scale;
  }
}

/** Names of an avatar -> where their values lie. */
interface Names {
  readonly expressions: ReadonlyMap<string, number>; // aliases included
  readonly listed: readonly string[]; // expressions without aliases
  readonly late: ReadonlyMap<string, number>;
  readonly joints: ReadonlyMap<string, number>;
}

const NAMES = new WeakMap<Avatar, Names>(); // poses of one avatar share them

function namesOf(avatar: Avatar): Names {
  const known = NAMES.get(avatar);
  if (known !== undefined) return known;
  const expressions = new Map<string, number>();
  avatar.expressions.forEach((one, index) => one.aliases.forEach((alias) => expressions.set(alias, index)));
  avatar.expressions.forEach((one, index) => expressions.set(one.name, index)); // a name wins over an alias
  const names = {
    expressions,
    listed: avatar.expressions.map((one) => one.name),
    late: new Map(avatar.eyelids.map((name, index) => [name, index])),
    joints: new Map((avatar.skeleton?.names ?? []).map((name, index) => [name, index])),
  };
  NAMES.set(avatar, names);
  return names;
}

function indexOf(what: string, name: string, among: ReadonlyMap<string, number>, listed?: readonly string[]): number {
  const index = among.get(name);
  if (index === undefined) throw noSuch(what, name, listed ?? [...among.keys()]);
  return index;
}

function finite(what: string, name: string, value: number): number {
  if (!(Math.abs(value) <= MOST_WEIGHT)) {
    throw new AvatarError(`${value} is not a finite float32`, { field: `${what} ${name}` });
  }
  return value;
}
