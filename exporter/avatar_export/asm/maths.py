"""The formulas of ASM (arXiv 2304.09423), NumPy in float64: weights from mixtures, bones on a mesh, poses.

Matrices act on column vectors and are [..., 4, 4]. Units are metres and radians.
"""

from __future__ import annotations

import numpy as np

from avatar_export.asm.model import AsmFace, Binding, Take, Template
from avatar_export.asm.plane import locate
from avatar_runtime.avatar import F64
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.joints import levels

ROWS = 1024  # vertices at once: [ROWS, J, K] densities at a time


def row_blocks(template: Template) -> list[slice]:
    """The vertices in blocks whose weights are computed at once; at least one block."""
    return [slice(at, at + ROWS) for at in range(0, max(len(template.vertices), 1), ROWS)]


@np.errstate(under="ignore")
def mixture_weight_rows(template: Template, binding: Binding, rows: slice) -> F64:
    """[v, J] skin weights of some vertices, rows add up to 1 (Eq. 4 and 6; `softplus`: models of the unofficial code).

    `normalised` divides densities by their sum, as logarithms. Far from every bone, where all densities underflow, the
    weight goes to the bone whose mixture falls off last, which is the limit of Eq. 6.
    `softplus`: softplus(W_j) / sum_i softplus(W_i), never 0.
    """
    log_density = log_mixtures(template, binding, rows)
    if template.weight_rule == "softplus":
        soft = np.logaddexp(0.0, np.exp(log_density))
        return np.asarray(soft / soft.sum(axis=1, keepdims=True))
    share = np.exp(log_density - log_density.max(axis=1, keepdims=True))
    return np.asarray(share / share.sum(axis=1, keepdims=True))


@np.errstate(divide="ignore")  # the logarithm of a mixture weight of 0 is -inf, its density is 0
def log_mixtures(template: Template, binding: Binding, rows: slice) -> F64:
    """[v, J] natural logarithms of W_j (Eq. 4) at the uv of some vertices."""
    uv = template.uv[rows].astype(np.float64)
    centre = binding.zeta[:, None] + binding.mu  # [J, K, 2]
    x = uv[:, None, None, 0] - centre[..., 0]
    y = uv[:, None, None, 1] - centre[..., 1]
    xx, xy, yy = np.moveaxis(binding.covariance, -1, 0)
    determinant = xx * yy - xy * xy
    squared = (yy * x * x - 2 * xy * x * y + xx * y * y) / determinant  # Mahalanobis, [v, J, K]
    log_density = np.log(binding.pi) - np.log(2 * np.pi) - np.log(determinant) / 2 - squared / 2
    top = log_density.max(axis=-1, keepdims=True)
    return np.asarray(top[..., 0] + np.log(np.exp(log_density - top).sum(axis=-1)))


def bone_positions(template: Template, binding: Binding) -> F64:
    """psi [J, 3]: psi^0 moved by the offset from v_t to the point of zeta on the mesh (Eq. 7 and 11)."""
    triangle, weights = locate(binding.zeta, template.uv.astype(np.float64), template.triangles)
    vertices = template.vertices.astype(np.float64)
    place = np.einsum("jc,jcx->jx", weights, vertices[template.triangles[triangle]])
    result: F64 = place - vertices[template.anchor_vertex] + template.rest_position.astype(np.float64)
    return result


def bind_matrices(template: Template, binding: Binding) -> F64:
    """B [J, 4, 4], mesh from bone: rotation and scale of the template at the bone's position (Eq. 14)."""
    return np.asarray(homogeneous(template.rest_linear.astype(np.float64), bone_positions(template, binding)))


def parent_from_bone(template: Template, bind: F64) -> F64:
    """M^l2p [J, 4, 4] of bind matrices (Eq. 16); a root's is its own bind matrix."""
    above = np.where((template.parents < 0)[:, None, None], np.eye(4), bind[template.parents])
    return np.asarray(np.linalg.solve(above, bind))


def pose_matrices(take: Take) -> F64:
    """M(tau) [T, J, 4, 4] = translation, rotation, scale; scale acts first."""
    linear = matrix_from_rotvec(take.rotation_vector) * take.scale[..., None, :]
    return np.asarray(homogeneous(linear, take.translation))


def skin_matrices(face: AsmFace, take: Take) -> F64:
    """T_j [T, J, 4, 4], mesh from mesh: M^trs down the chain, then B_j^-1 (Eq. 13 and 15)."""
    bind = bind_matrices(face.template, face.binding)
    posed = parent_from_bone(face.template, bind) @ pose_matrices(take)
    for level in levels(face.template.parents)[1:]:
        posed[:, level] = posed[:, face.template.parents[level]] @ posed[:, level]
    return np.asarray(posed @ np.linalg.inv(bind))


def posed(face: AsmFace, take: Take, frame: int = 0) -> F64:
    """Vertices [V, 3] of one frame, by all weights (Eq. 3 and 12). Raises IndexError without that frame."""
    return np.asarray(posed_by(face, skin_matrices(face, one_frame(take, frame)))[0])


def posed_by(face: AsmFace, skin_matrix: F64) -> F64:
    """Vertices [T, V, 3] of skin matrices [T, J, 4, 4] (Eq. 12)."""
    vertices = face.template.vertices.astype(np.float64)
    found = np.empty((len(skin_matrix), len(vertices), 3))
    for rows in row_blocks(face.template):
        weights = mixture_weight_rows(face.template, face.binding, rows)
        for frame, matrix in enumerate(skin_matrix[:, :, :3]):
            blended = np.tensordot(weights, matrix, axes=1)  # [v, 3, 4]
            moved = blended[..., :3] @ vertices[rows][..., None]
            found[frame, rows] = moved[..., 0] + blended[..., 3]
    return found


def one_frame(take: Take, frame: int) -> Take:
    """A take of one frame of `take`. Raises IndexError for a frame that does not exist."""
    part = slice(frame, frame + 1) if frame >= 0 else slice(frame, frame + 1 or None)
    if not -len(take.scale) <= frame < len(take.scale):
        raise IndexError(f"frame {frame} of a take of {len(take.scale)}")
    return Take(take.name, take.fps, take.rotation_vector[part], take.translation[part], take.scale[part])
