"""Stage `skin`: linear blend skinning of the mesh, then late morphs."""

from __future__ import annotations

from avatar_runtime.avatar import F32, Rig
from avatar_runtime.stages.sparse import combine, gather


def skin(rig: Rig, vertices: F32, skin_matrix: F32, late_weights: F32) -> F32:
    """V' = sum_b W_b A_b V, then eyelids, unrotated (as metrical-tracker and GaussianBlendshapes do). [V, 3]."""
    posed = transform(gather(rig.skin, skin_matrix[:, :3]), vertices)
    return posed + combine(rig.late_morphs, late_weights)["position"]


def vertex_matrices(rig: Rig, skin_matrix: F32) -> F32:
    """[V, 3, 3] linear part of sum_b W_b A_b of each vertex, which transforms directions there."""
    return gather(rig.skin, skin_matrix[:, :3, :3])


def transform(matrix: F32, points: F32) -> F32:
    """matrix [..., 3, 4] applied to points [..., 3]; sums from left to right."""
    x, y, z = points[..., 0, None], points[..., 1, None], points[..., 2, None]
    result: F32 = matrix[..., 0] * x + matrix[..., 1] * y + matrix[..., 2] * z + matrix[..., 3]
    return result
