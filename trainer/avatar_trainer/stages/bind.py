"""Stage `bind` of Gaussians that follow joints or groups; twin of `avatar_runtime.stages.bind`."""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from avatar_trainer.stages.rotation import quat_from_matrix, quat_multiply
from avatar_trainer.stages.skin import transform
from avatar_trainer.tensors import Gaussians


def skin_matrices(weights: Tensor, skin_matrix: Tensor) -> Tensor:
    """[N, 3, 4] sum_j w_ij A_j of dense `weights` [N, J] and `skin_matrix` [J, 4, 4]."""
    return (weights @ skin_matrix[:, :3].reshape(-1, 12)).reshape(-1, 3, 4)


def bind_skin(
    blended: Gaussians,
    matrix: Tensor,  # [N, 3, 4] of positions, or [3, 4] for all
    rotation: Tensor,  # [N, 3, 3] of quaternions, or [3, 3] for all
    corrective: Tensor | None = None,  # [N, 3] added before the matrix
    late: Tensor | None = None,  # [N, 3] added after it, unrotated
) -> tuple[Gaussians, Tensor]:
    """(Gaussians in mesh space, the frame [N, 3, 3] in which their SH are seen): x' = M (x + c) + l, q' = quat(R) q.

    Differentiable in everything. `rotation` is the polar factor of `matrix` for binding skin.
    """
    mean = blended.mean if corrective is None else blended.mean + corrective
    mean = transform(matrix, mean)
    quat = quat_multiply(quat_from_matrix(rotation).expand_as(blended.quat_wxyz), blended.quat_wxyz)
    bound = replace(blended, mean=mean if late is None else mean + late, quat_wxyz=quat)
    return bound, rotation.expand(len(mean), 3, 3)


def place(gaussians: Gaussians, rotation: Tensor, world_from_avatar: Tensor) -> tuple[Gaussians, Tensor]:
    """(Gaussians, SH frame) moved rigidly by `world_from_avatar` [4, 4]; the identity changes no bit."""
    if torch.equal(world_from_avatar, torch.eye(4, dtype=world_from_avatar.dtype)):
        return gaussians, rotation
    world = world_from_avatar.to(gaussians.mean.dtype)
    placed, _ = bind_skin(gaussians, world[:3], world[:3, :3])
    return placed, world[:3, :3] @ rotation
