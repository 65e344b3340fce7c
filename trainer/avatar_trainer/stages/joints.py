"""Stage `joints`: rest joints, the kinematic chain, pose features; twin of `avatar_runtime.stages.joints`."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avatar_trainer.stages.rig import RigTensors


@dataclass(frozen=True)
class Joints:
    """The results of the skeleton that later stages read."""

    skin_matrix: Tensor  # [J, 4, 4] mesh from binding mesh: A
    pose_feature: Tensor  # [9 C] row-major R - I of the corrective joints
    rest_position: Tensor  # [J, 3] with the expression's part
    position: Tensor  # [J, 3] posed


def joints(rig: RigTensors, expression_weights: Tensor, joint_delta: Tensor) -> Joints:
    """Rest joints J0 + sum_k w_k J_k, global = parent @ rest_local @ delta, A = global @ inverse bind.

    `expression_weights` [K], `joint_delta` [J, 4, 4]; differentiable in both. Computed in float64, given in the
    rig's type. Source: as `avatar_runtime.stages.joints.joints`.
    """
    delta, dtype = joint_delta.double(), rig.vertices.dtype
    moved = torch.einsum("k,kjx->jx", expression_weights.double(), rig.joint_basis)
    rest = _translated(moved, rig.rest)
    posed: list[Tensor] = []
    for joint, parent in enumerate(rig.parents):
        local = rest[joint]
        if parent >= 0:
            local = posed[parent] @ torch.linalg.solve(rest[parent], local)
        posed.append(local @ delta[joint])
    world = torch.stack(posed)
    eye = torch.eye(4, dtype=torch.float64)
    skin_matrix = world @ rig.inverse_bind_matrix @ _translated(-moved, eye.expand(len(posed), 4, 4))
    feature = (delta[rig.corrective_joints, :3, :3] - eye[:3, :3]).reshape(-1)
    results = (skin_matrix, feature, rest[:, :3, 3], world[:, :3, 3])
    return Joints(*(result.to(dtype) for result in results))


def _translated(offset: Tensor, matrix: Tensor) -> Tensor:
    """`matrix` [J, 4, 4] and then a translation by `offset` [J, 3]."""
    column = torch.nn.functional.pad(offset, (0, 1))
    return matrix + column[:, :, None] * matrix[:, 3:]
