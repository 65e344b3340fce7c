"""Stage `skin`: linear blend skinning of the mesh, then late morphs; twin of `avatar_runtime.stages.skin`."""

from __future__ import annotations

from torch import Tensor

from avatar_trainer.stages.rig import RigTensors
from avatar_trainer.stages.sparse import combine, gather


def skin(rig: RigTensors, vertices: Tensor, skin_matrix: Tensor, late_weights: Tensor) -> Tensor:
    """V' = sum_b W_b A_b V, then late morphs, unrotated. [V, 3]; differentiable in all but the rig."""
    posed = transform(gather(rig.skin, skin_matrix[:, :3]), vertices)
    return posed + combine(rig.late_morphs, late_weights)


def transform(matrix: Tensor, points: Tensor) -> Tensor:
    """matrix [..., 3, 4] applied to points [..., 3]."""
    return (matrix[..., :3] * points[..., None, :]).sum(-1) + matrix[..., 3]
