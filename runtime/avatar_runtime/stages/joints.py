"""Stage `joints`: rest joints, the kinematic chain, pose features. Small, on the CPU, in float64."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F32, Rig
from avatar_runtime.pose import PoseArrays
from avatar_runtime.rotation import translation_matrix


@dataclass(frozen=True)
class Joints:
    """What later stages read of the skeleton."""

    skin_matrix: F32  # [J, 4, 4] mesh from binding mesh: A
    pose_feature: F32  # [9 C] row-major R - I of the corrective joints
    rest_position: F32  # [J, 3] with the expression's part
    position: F32  # [J, 3] posed


@np.errstate(
    over="ignore", invalid="ignore"
)  # a rest pose beyond float32 becomes infinite, which is not drawn
def joints(rig: Rig, pose: PoseArrays) -> Joints:
    """Rest joints J0 + sum_k w_k J_k, global = parent @ rest_local @ delta, A = global @ inverse bind.

    An expression moves a rest joint by an offset d in mesh space: its rest transform and its bind transform
    both gain that translation, so that the neutral A stays what it was. Source: smplx lbs, GaussianBlendshapes
    2952da7 FLAME/lbs.py; the same for rest joints with rotation and scale.
    """
    moved = np.tensordot(pose.expression_weights.astype(np.float64), rig.joint_basis, axes=1)  # [J, 3]
    rest = rest_transforms(rig)
    rest_moved = translation_matrix(moved) @ rest
    posed = np.empty_like(rest)
    for j, parent in enumerate(rig.parents):
        if parent < 0:
            local = rest_moved[j]
            posed[j] = local @ pose.joint_delta[j]
        else:
            local = np.linalg.solve(rest_moved[parent], rest_moved[j])
            posed[j] = posed[parent] @ local @ pose.joint_delta[j]
    skin_matrix = posed @ rig.inverse_bind_matrix.astype(np.float64) @ translation_matrix(-moved)
    rotations = pose.joint_delta[rig.corrective_joints, :3, :3]
    return Joints(
        skin_matrix.astype(np.float32),
        (rotations - np.eye(3)).astype(np.float32).reshape(-1),
        rest_moved[:, :3, 3].astype(np.float32),
        posed[:, :3, 3].astype(np.float32),
    )


def rest_transforms(rig: Rig) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """mesh_from_joint at rest, [J, 4, 4]."""
    rest = rig.rest_local.astype(np.float64)
    for j, parent in enumerate(rig.parents):
        if parent >= 0:
            rest[j] = rest[parent] @ rest[j]
    return rest
