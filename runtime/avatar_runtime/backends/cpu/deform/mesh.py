"""Stages `morph` and `skin` of the rig's mesh, and how skinning turns it. One thread: the work is small."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.arrays import Influences, Offsets
from avatar_runtime.backends.cpu.deform.blend import offset_of
from avatar_runtime.backends.cpu.jit import kernel

ZERO = np.float32(0)


@kernel()
def morph(
    template: F32,  # [V, 3]
    morphs: Offsets,
    correctives: Offsets,
    expression_weights: F32,  # [K]
    pose_feature: F32,  # [9 C]
    out: F32,  # [V, 3]
) -> None:
    """V = template + sum_k w_k morph_k + sum_j feature_j corrective_j."""
    for v in range(len(template)):
        x, y, z = offset_of(v, morphs, expression_weights)
        cx, cy, cz = offset_of(v, correctives, pose_feature)
        out[v, 0] = template[v, 0] + x + cx
        out[v, 1] = template[v, 1] + y + cy
        out[v, 2] = template[v, 2] + z + cz


@kernel()
def vertex_matrices(influences: Influences, skin_matrix: F32, out: F32) -> None:
    """`out` [V, 9]: the linear part of sum_b W_b A_b of `skin_matrix` [J, 16], row-major."""
    for v in range(len(out)):
        out[v] = ZERO
        for e in range(influences.row_ptr[v], influences.row_ptr[v + 1]):
            weight, joint = influences.weight[e], influences.joint[e]
            for k in range(9):
                out[v, k] += skin_matrix[joint, k // 3 * 4 + k % 3] * weight


@kernel()
def skin(
    vertices: F32,  # [V, 3]
    influences: Influences,
    skin_matrix: F32,  # [J, 16]
    late_morphs: Offsets,
    late_weights: F32,  # [L]
    out: F32,  # [V, 3]
) -> None:
    """V' = sum_b W_b A_b V, then late morphs, unrotated."""
    matrix = np.empty(12, np.float32)
    for v in range(len(vertices)):
        matrix[:] = ZERO
        for e in range(influences.row_ptr[v], influences.row_ptr[v + 1]):
            weight, joint = influences.weight[e], influences.joint[e]
            for k in range(12):
                matrix[k] += skin_matrix[joint, k] * weight
        x, y, z = vertices[v, 0], vertices[v, 1], vertices[v, 2]
        late = offset_of(v, late_morphs, late_weights)
        for k in range(3):
            moved = matrix[4 * k] * x + matrix[4 * k + 1] * y + matrix[4 * k + 2] * z + matrix[4 * k + 3]
            out[v, k] = moved + late[k]
