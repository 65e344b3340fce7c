"""Splats moved rigidly, as a pose places the whole avatar in the world."""

from __future__ import annotations

from dataclasses import replace

from torch import Tensor

from avatar_trainer.stages.rotation import quat_from_matrix, quat_multiply
from avatar_trainer.stages.skin import transform
from avatar_trainer.tensors import Splats


def moved(splats: Splats, world: Tensor) -> Splats:
    """Splats moved rigidly by `world` [4, 4]; their colours move along."""
    turn = quat_from_matrix(world[:3, :3])
    return replace(
        splats,
        mean=transform(world[:3], splats.mean),
        quat_wxyz=quat_multiply(turn.expand_as(splats.quat_wxyz), splats.quat_wxyz),
        sh_rotation=None if splats.sh_rotation is None else world[:3, :3] @ splats.sh_rotation,
    )
