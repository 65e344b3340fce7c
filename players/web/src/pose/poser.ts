import type { Avatar } from "../avatar.js";
import { Chain } from "./chain.js";
import { Groups } from "./groups.js";
import type { Pose } from "./pose.js";

/** The small inputs of one frame: everything that a GPU receives for a pose. */
export interface Posed {
  /** The content of buffer Pose: weights [K], features [9 C], late weights [L], skin matrices [J, 3, 4]. */
  readonly poseFloats: Float32Array;
  /** Of each group, mesh from binding mesh, [G, 3, 4]. */
  readonly groupMatrix: Float32Array;
  /** Of each group, the rotation of its Gaussians, [G, 3, 4] with a last column of 0. */
  readonly groupRotation: Float32Array;
  /** Rigid transform of the pose, [4, 4] row-major. It is the pose's own array. */
  readonly worldFromAvatar: Float64Array;
}

/** Stage `joints` of one avatar, in float64 on the CPU. `update` allocates nothing. */
export class Poser {
  private readonly chain: Chain | null;
  private readonly groups: Groups;
  private readonly posed: { -readonly [K in keyof Posed]: Posed[K] };
  private readonly features: Float32Array; // views of poseFloats
  private readonly joints: Float32Array;
  private readonly correctives: Uint32Array;

  constructor(private readonly avatar: Avatar) {
    const { pose, poseFloats } = avatar.program;
    const floats = new Float32Array(poseFloats);
    this.features = floats.subarray(pose.features, pose.late);
    this.joints = floats.subarray(pose.joints, poseFloats);
    this.correctives = avatar.skeleton?.correctiveJoints ?? new Uint32Array(0);
    this.chain = avatar.skeleton && new Chain(avatar.skeleton);
    this.groups = new Groups(avatar);
    this.posed = {
      poseFloats: floats,
      groupMatrix: this.groups.matrix,
      groupRotation: this.groups.rotation,
      worldFromAvatar: new Float64Array(16),
    };
  }

  /** The inputs of a frame for `pose`, a pose of this avatar: the same object and arrays every time. */
  update(pose: Pose): Posed {
    const { poseFloats } = this.posed;
    const { weights, late } = this.avatar.program.pose;
    poseFloats.set(pose.expressionWeights, weights);
    poseFloats.set(pose.lateWeights, late);
    this.posed.worldFromAvatar = pose.worldFromAvatar;
    if (this.chain !== null) {
      this.setFeatures(pose.jointDelta);
      this.chain.update(pose.expressionWeights, pose.jointDelta);
      this.joints.set(this.chain.skin);
      this.groups.anchors?.update(pose.expressionWeights, this.features, pose.lateWeights, this.chain.skin);
      this.groups.update(this.chain.skin);
    }
    return this.posed;
  }

  /** Row-major R - I of the corrective joints. */
  private setFeatures(delta: Float64Array): void {
    for (let c = 0; c < this.correctives.length; c++) {
      const from = 16 * (this.correctives[c] as number);
      for (let k = 0; k < 9; k++) {
        const row = (k / 3) | 0;
        const column = k - 3 * row;
        this.features[9 * c + k] = (delta[from + 4 * row + column] as number) - (row === column ? 1 : 0);
      }
    }
  }
}
