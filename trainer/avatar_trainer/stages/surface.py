"""Part of stage `bind`: Gaussians embedded in a triangle mesh; twin of `avatar_runtime.stages.surface`.

SplattingAvatar's rules, of the released code and of the paper, and PSAvatar's. Sums over the mesh are float64,
as in the runtime: the sign of a triangle's quaternion is a decision, and float32 would decide by its rounding.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, U32, Rules
from avatar_runtime import rules as runtime_rules
from avatar_schema import constants
from avatar_trainer.stages.rotation import matrix_from_quat, polar, quat_from_matrix, quat_multiply

TINY = 1e-30  # avoids a division by a length of 0


@dataclass(frozen=True)
class SurfaceMesh:
    """The canonical mesh, which no pose and no training step changes. Made by `surface_mesh`."""

    triangles: Tensor  # [F, 3] int64
    vertices: int
    frame: Tensor  # [F, 3, 3] columns, float64; mesh from triangle
    area: Tensor  # [F] float64, bundle units squared
    training_per_bundle: float


@dataclass(frozen=True)
class PosedMesh:
    """What Gaussians read of one posed mesh."""

    vertices: Tensor  # [V, 3]
    vertex_normal: Tensor  # [V, 3] of length 1 or less
    # [V, 4] wxyz, turn since the canonical pose, any length; for rules.RIGGED_ROTATIONS [V, 9], row-major: the linear
    # part of sum_j W_vj A_j, without a gradient
    vertex_turn: Tensor
    area: Tensor  # [F] float64, bundle units squared


@dataclass(frozen=True)
class EmbeddedGaussians:
    """Embedded Gaussians on a posed mesh."""

    mean: Tensor  # [N, 3]
    quat_wxyz: Tensor  # [N, 4] any length
    rotation: (
        Tensor  # [N, 3, 3] of the mesh under each Gaussian, no gradient; colour is seen along rotation^T d
    )
    log_scale: Tensor  # [N, 3]


def surface_mesh(canonical_vertices: F32, triangles: U32, training_per_bundle: float) -> SurfaceMesh:
    """The mesh of the pose in which every rule is the identity: vertices [V, 3] in bundle units, triangles [F, 3].

    Raises ValueError for a triangle with a vertex that does not exist.
    """
    count = len(canonical_vertices)
    index = torch.from_numpy(triangles.astype(np.int64))
    if len(index) and int(index.max()) >= count:
        raise ValueError(f"triangles name vertex {int(index.max())}, but there are {count}")
    frame, _, area = _triangles(torch.from_numpy(canonical_vertices.astype(np.float64)), index)
    return SurfaceMesh(index, count, frame, area, training_per_bundle)


def check_rules(rules: Rules) -> None:
    """Raise ValueError for a surface rule that is not trained (those of GaussianAvatars, older quaternion signs)."""
    known: dict[str, Collection[str]] = {
        "rotation": UNIT_TURNS,
        "position": POSITIONS,
        "scale": SCALES,
        "quaternion_sign": ("w_positive",),
    }
    for name, values in known.items():
        value = getattr(rules, name)
        if value not in values:
            raise ValueError(f"rule {name} {value!r} is not trained; one of {', '.join(values)} is")


def pose_mesh(
    vertices: Tensor, mesh: SurfaceMesh, rules: Rules, vertex_matrix: Tensor | None = None
) -> PosedMesh:
    """Vertex normals and turns, and triangle areas of the posed `vertices` [V, 3]; differentiable in them.

    `vertex_matrix` [V, 3, 3] or [V, 3, 4], only for rules.RIGGED_ROTATIONS: sum_j W_vj A_j of each vertex.
    Raises ValueError if it is missing, if no rule reads it, and for a rule that is not trained.
    Triangle quaternion: posed frame times inverse canonical frame, w made positive; neighbours of opposite sign cancel.
    Source: SplattingAvatar 3847314 splatting_avatar_model.py, utils/map.py; paper Eqs. 4, 5. The definition;
    `kernels.pose_mesh_cpu` is the fast one.
    """
    check_rules(rules)
    frame, across, area = _triangles(vertices.double(), mesh.triangles)
    normal = _floored(_at_vertices(across, mesh), "normal_floor", mesh)
    turn = linear_rows(vertex_matrix, mesh, rules)
    if turn is None:
        quat = quat_from_matrix(frame @ mesh.frame.transpose(-1, -2))
        quat = torch.where(quat[:, :1] < 0, -quat, quat)
        turn = VERTEX_TURNS[rules.rotation](_at_vertices(mesh.area[:, None] * quat, mesh), mesh)
    return PosedMesh(vertices, normal.to(vertices.dtype), turn.to(vertices.dtype), area)


def linear_rows(vertex_matrix: Tensor | None, mesh: SurfaceMesh, rules: Rules) -> Tensor | None:
    """[V, 9] of [V, 3, 3] or [V, 3, 4], detached; None if the rotation rule reads no matrices.

    Raises ValueError if `vertex_matrix` is missing, of another shape, or not read.
    """
    rigged = rules.rotation in runtime_rules.RIGGED_ROTATIONS
    if rigged != (vertex_matrix is not None):
        raise ValueError(
            f"rule rotation {rules.rotation!r}: vertex_matrix goes with {', '.join(runtime_rules.RIGGED_ROTATIONS)}"
        )
    if vertex_matrix is None:
        return None
    if vertex_matrix.shape not in ((mesh.vertices, 3, 3), (mesh.vertices, 3, 4)):
        raise ValueError(f"vertex_matrix is {tuple(vertex_matrix.shape)}, not [{mesh.vertices}, 3, 3 or 4]")
    return vertex_matrix[:, :, :3].detach().reshape(-1, 9)


def embed(
    posed: PosedMesh,
    mesh: SurfaceMesh,
    triangle: Tensor,  # [N] int64
    barycentric: Tensor,  # [N, 3] of the triangle's corners 0, 1, 2
    displacement: Tensor,  # [N] bundle units
    local_quat_wxyz: Tensor,  # [N, 4]
    log_scale: Tensor,  # [N, 3] ln of bundle units, of the canonical pose
    rules: Rules,
) -> EmbeddedGaussians:
    """Gaussians on the posed mesh; differentiable in all floating inputs.

    The rotation of rules.RIGGED_ROTATIONS has no gradient. A gradient could not reach the vertices, and the
    rotation is almost the same at the corners of one triangle.
    Source: SplattingAvatar 3847314 splatting_avatar_model.py:75; paper Eqs. 2 to 5; PSAvatar, Eqs. 8 to 11. Raises
    ValueError for a rule that is not trained.
    """
    check_rules(rules)
    table = torch.cat([posed.vertices, posed.vertex_normal, posed.vertex_turn], dim=1)
    corners = table[mesh.triangles[triangle]]  # [N, 3, 10 or 15]
    under = (barycentric[:, :, None] * corners).sum(1)
    foot, normal, turn = under[:, :3], under[:, 3:6], under[:, 6:]
    unit = UNIT_TURNS[rules.rotation](turn)
    factor, shift = scale_change(posed, mesh, triangle, rules)
    return EmbeddedGaussians(
        foot + displacement[:, None] * POSITIONS[rules.position](normal),
        quat_multiply(unit, local_quat_wxyz),
        matrix_from_quat(unit.detach()),
        log_scale * factor[:, None].to(log_scale.dtype) + shift[:, None].to(log_scale.dtype),
    )


def bary_vertex_rotation(vertex_matrix: Tensor, corners: Tensor, barycentric: Tensor) -> Tensor:
    """[N, 3, 3] polar3(sum_c b_c M_c): the rotation of the skinned mesh under each Gaussian.

    `vertex_matrix` [V, 3, 3] or [V, 3, 4]: sum_j W_vj A_j of each vertex, of which the linear part is read;
    `corners` [N, 3] int64 vertex ids; `barycentric` [N, 3]. Differentiable in the matrices and the barycentrics.
    Source: PSAvatar, Eq. 11, whose sum of matrices is not a rotation if the corners rotate differently.
    """
    linear = vertex_matrix[..., :3][corners]  # [N, 3, 3, 3]
    return polar((barycentric[:, :, None, None] * linear).sum(1))


def _of_matrices(turn: Tensor) -> Tensor:
    """Unit quaternion of the polar factor of `turn` [N, 9]."""
    quat = quat_from_matrix(polar(turn.detach().reshape(-1, 3, 3)))
    return quat / _length(quat)


def _triangles(vertices: Tensor, triangles: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """(frames [F, 3, 3] as columns, edge cross edge [F, 3], areas [F])."""
    a, b, c = vertices[triangles].unbind(1)
    e = b - a
    across = e.cross(c - a, dim=1)
    x = _unit(e.cross(_unit(across), dim=1))
    frame = torch.stack([x, _unit(e.cross(x, dim=1)), _unit(e)], dim=-1)
    return frame, across, torch.linalg.vector_norm(across, dim=1) / 2


def _at_vertices(by_triangle: Tensor, mesh: SurfaceMesh) -> Tensor:
    """[V, ...] sums over each vertex's triangles."""
    total = by_triangle.new_zeros((mesh.vertices, by_triangle.shape[1]))
    return total.index_add(0, mesh.triangles.reshape(-1), by_triangle.repeat_interleave(3, dim=0))


def _floored(total: Tensor, floor: str, mesh: SurfaceMesh) -> Tensor:
    """Divided by the length, or by the floor (an area in training units) where that is larger."""
    least = float(constants()[floor]) / mesh.training_per_bundle**2
    length: Tensor = torch.linalg.vector_norm(total, dim=1, keepdim=True)
    return total / length.clamp_min(least)


def _length(v: Tensor) -> Tensor:
    length: Tensor = torch.linalg.vector_norm(v, dim=-1, keepdim=True)
    return length.clamp_min(TINY)


def _unit(v: Tensor) -> Tensor:
    return v / _length(v)


def _of_unit_length(total: Tensor, mesh: SurfaceMesh) -> Tensor:
    return _floored(total, "quaternion_floor", mesh)


def _mean_by_area(total: Tensor, mesh: SurfaceMesh) -> Tensor:
    """Paper Eq. 5: divided by the sum of areas, not made unit."""
    return total / _at_vertices(mesh.area[:, None], mesh).clamp_min(TINY)


def _as_it_is(normal: Tensor) -> Tensor:
    return normal


def scale_change(
    posed: PosedMesh, mesh: SurfaceMesh, triangle: Tensor, rules: Rules
) -> tuple[Tensor, Tensor]:
    """(factor [N], shift [N]), float64: on the posed mesh a log scale becomes factor * log_scale + shift."""
    return SCALES[rules.scale](posed.area[triangle], mesh.area[triangle], mesh.training_per_bundle)


def _same_scale(posed: Tensor, canonical: Tensor, training_per_bundle: float) -> tuple[Tensor, Tensor]:
    return torch.ones_like(posed), torch.zeros_like(posed)


def _log_area(posed: Tensor, canonical: Tensor, training_per_bundle: float) -> tuple[Tensor, Tensor]:
    """The damped ratio of areas multiplies the logarithm of the scale in training units: (l + ln u) ratio - ln u."""
    damping = float(constants()["area_damping"]) / training_per_bundle**2
    ratio = (posed + damping) / (canonical + damping)
    return ratio, (ratio - 1) * float(np.log(training_per_bundle))


def _linear_area(posed: Tensor, canonical: Tensor, training_per_bundle: float) -> tuple[Tensor, Tensor]:
    """Paper: s = (A / A0) s0."""
    return torch.ones_like(posed), (posed.clamp_min(TINY) / canonical).log()


VERTEX_TURNS = {"vertex_quaternion": _of_unit_length, "vertex_quaternion_mean": _mean_by_area}
UNIT_TURNS = {
    **dict.fromkeys(VERTEX_TURNS, _unit),
    **dict.fromkeys(runtime_rules.RIGGED_ROTATIONS, _of_matrices),
}
POSITIONS = {"normal": _unit, "interpolated_normal": _as_it_is}
SCALES = {"none": _same_scale, "log_area": _log_area, "linear_area": _linear_area}
