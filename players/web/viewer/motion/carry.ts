// A pose that goes on where an avatar is loaded again or another takes its place.
import type { Avatar, Pose } from "../../src/index.js";

/** Copies what both avatars have, by name: expressions, eyelids and joints. */
export function carryPose(from: Avatar, fromPose: Pose, to: Avatar, toPose: Pose): void {
  const names = from.expressions.map((expression) => expression.name);
  to.expressions.forEach((expression, i) => {
    const old = names.indexOf(expression.name);
    if (old >= 0) toPose.expressionWeights[i] = fromPose.expressionWeights[old]!;
  });
  to.eyelids.forEach((name, i) => {
    const old = from.eyelids.indexOf(name);
    if (old >= 0) toPose.lateWeights[i] = fromPose.lateWeights[old]!;
  });
  const joints = from.skeleton?.names ?? [];
  (to.skeleton?.names ?? []).forEach((name, i) => {
    const old = joints.indexOf(name);
    if (old >= 0) toPose.jointDelta.set(fromPose.jointDelta.subarray(16 * old, 16 * old + 16), 16 * i);
  });
  toPose.worldFromAvatar.set(fromPose.worldFromAvatar);
}
