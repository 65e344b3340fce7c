"""Stage `joints`: rest joints, the kinematic chain, pose features. Small, on the CPU, in float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F32, F64, I32, I64, Rig
from avatar_runtime.pose import PoseArrays
from avatar_runtime.rotation import translation_matrix


@dataclass(frozen=True)
class Joints:
    """The results of the skeleton that later stages read."""

    skin_matrix: F32  # [J, 4, 4] mesh from binding mesh: A
    pose_feature: F32  # [9 C] row-major R - I of the corrective joints
    rest_position: F32  # [J, 3] with the expression's part
    position: F32  # [J, 3] posed


def joints(rig: Rig, pose: PoseArrays) -> Joints:
    """Rest joints J0 + sum_k w_k J_k, global = parent @ rest_local @ delta, A = global @ inverse bind.

    An expression moves a rest joint by an offset d in mesh space: its rest transform and its bind transform
    both gain that translation, so that the neutral A stays what it was. Source: smplx lbs, GaussianBlendshapes
    2952da7 FLAME/lbs.py; the same for rest joints with rotation and scale.
    """
    skin_matrix, rest_moved, posed = chain(rig, pose.expression_weights, pose.joint_delta)
    with np.errstate(over="ignore"):  # a rest pose beyond float32 becomes infinite, which is not drawn
        return Joints(
            skin_matrix.astype(np.float32),
            pose_features(rig, pose.joint_delta),
            rest_moved[:, :3, 3].astype(np.float32),
            posed[:, :3, 3].astype(np.float32),
        )


@np.errstate(over="ignore", invalid="ignore")
def chain(rig: Rig, expression_weights: F32, joint_delta: F64) -> tuple[F64, F64, F64]:
    """(skin matrices A, moved rest transforms, posed transforms), float64 [..., J, 4, 4] each, of
    `expression_weights` [..., K] and `joint_delta` [..., J, 4, 4].
    """
    moved = np.tensordot(expression_weights.astype(np.float64), rig.joint_basis, axes=1)  # [..., J, 3]
    rest_moved = translation_matrix(moved) @ rest_transforms(rig)
    posed = np.empty_like(rest_moved)
    for level in levels(rig.parents):
        parent = rig.parents[level]
        local: F64 = rest_moved[..., level, :, :]
        if parent[0] >= 0:
            local = posed[..., parent, :, :] @ np.linalg.solve(rest_moved[..., parent, :, :], local)
        posed[..., level, :, :] = local @ joint_delta[..., level, :, :]
    skin_matrix = posed @ rig.inverse_bind_matrix.astype(np.float64) @ translation_matrix(-moved)
    return skin_matrix, rest_moved, posed


def levels(parents: I32) -> list[I64]:
    """Joints by depth, roots first: each level depends only on the one before."""
    depth = np.zeros(len(parents), np.int64)
    for joint, parent in enumerate(parents):
        depth[joint] = 0 if parent < 0 else depth[parent] + 1
    return [np.flatnonzero(depth == level) for level in range(int(depth.max(initial=-1)) + 1)]


@np.errstate(over="ignore")
def pose_features(rig: Rig, joint_delta: F64) -> F32:
    """Row-major R - I of the corrective joints, [..., 9 C], of `joint_delta` [..., J, 4, 4]."""
    rotations = joint_delta[..., rig.corrective_joints, :3, :3]
    features: F32 = (rotations - np.eye(3)).astype(np.float32)
    return features.reshape(*joint_delta.shape[:-3], 9 * len(rig.corrective_joints))


def rest_transforms(rig: Rig) -> F64:
    """mesh_from_joint at rest, [J, 4, 4]."""
    rest = rig.rest_local.astype(np.float64)
    for j, parent in enumerate(rig.parents):
        if parent >= 0:
            rest[j] = rest[parent] @ rest[j]
    return rest
