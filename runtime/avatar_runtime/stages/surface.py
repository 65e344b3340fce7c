"""Part of stage `bind`: Gaussians embedded in a triangle mesh.

Sums are float64 and results float32: the sign of a triangle's quaternion is a decision, and near half a turn
the rounding of float32 would decide it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F32, F64, U32, Embedding, Rules
from avatar_runtime.handedness import mirrored_matrices, mirrored_quats
from avatar_runtime.rotation import matrix_from_quat, polar, quat_from_matrix, quat_multiply
from avatar_runtime.topology import vertex_triangles
from avatar_schema import constants

TINY = 1e-30  # avoids a division by a length of 0; the results are 0 or not finite and are not drawn


@dataclass(frozen=True)
class TriangleShape:
    """Frames and sizes of a mesh's triangles, as the rules read them."""

    frame: F64  # [F, 3, 3] columns; world from triangle
    size: F64  # [F] GaussianAvatars' rules: mean of an edge and its height; else area


@dataclass(frozen=True)
class Surface:
    """An embedding and everything about it that no pose changes; `prepare` makes it once."""

    embedding: Embedding
    rules: Rules
    training_per_bundle: float
    canonical: TriangleShape
    vertex_triangle_ptr: U32  # [V + 1]
    vertex_triangle: U32  # [3 F]


@dataclass(frozen=True)
class EmbeddedPose:
    """Embedded Gaussians on a posed mesh."""

    mean: F32  # [N, 3]
    quat_wxyz: F32  # [N, 4] any length
    rotation: F32  # [N, 3, 3] of the mesh under each Gaussian; SH are evaluated along rotation^T d
    log_scale: F32  # [N, 3]


def prepare(embedding: Embedding, rules: Rules, training_per_bundle: float) -> Surface:
    """The parts of surface binding that no pose changes."""
    shape = triangle_shape(embedding.canonical_vertices, embedding.triangles, rules)
    lists = vertex_triangles(embedding.triangles, len(embedding.canonical_vertices))
    return Surface(embedding, rules, training_per_bundle, shape, *lists)


def pose_embedded(
    surface: Surface, vertices: F32, log_scale: F32, vertex_matrix: F32 | None = None
) -> EmbeddedPose:
    """Embedded Gaussians on the posed `vertices` [V, 3]; `log_scale` [N, 3] is that of the binding pose.

    `vertex_matrix` [V, 3, 3], for `RIGGED_ROTATIONS` alone, is `stages.skin.vertex_matrices` of the pose.
    Source: SplattingAvatar 3847314 splatting_avatar_model.py and utils/map.py, and for the rules of the paper
    its section 3.1; GaussianAvatars 30cc4bd gaussian_model.py and mesh_renderer utils; PSAvatar, section 3.3.
    """
    shape = triangle_shape(vertices, surface.embedding.triangles, surface.rules)
    turn = TURNS[surface.rules.rotation](surface, shape, vertex_matrix)  # [N, 4] any length
    length = np.linalg.norm(turn, axis=1, keepdims=True)
    unit = turn / np.maximum(length, TINY)
    return EmbeddedPose(
        POSITIONS[surface.rules.position](surface, vertices, shape).astype(np.float32),
        quat_multiply(unit, surface.embedding.local_quat_wxyz.astype(np.float64)).astype(np.float32),
        matrix_from_quat(unit).astype(np.float32),
        SCALES[surface.rules.scale](surface, shape, log_scale),
    )


def binding_pose(embedding: Embedding, rules: Rules, training_per_bundle: float) -> tuple[F32, F32]:
    """(mean [N, 3], quat_wxyz [N, 4]) on the canonical mesh: gaussians.ply holds these for binding surface."""
    surface = prepare(embedding, rules, training_per_bundle)
    still = np.zeros((len(embedding.triangle), 3), np.float32)
    unturned = np.tile(np.eye(3, dtype=np.float32), (len(embedding.canonical_vertices), 1, 1))
    posed = pose_embedded(surface, embedding.canonical_vertices, still, unturned)
    return posed.mean, posed.quat_wxyz


def triangle_shape(vertices: F32, triangles: U32, rules: Rules) -> TriangleShape:
    """Frames and sizes of triangles, by the rotation rule that will read them."""
    corner = vertices.astype(np.float64)[triangles]
    e, f = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    across = np.cross(e, f)
    if rules.rotation != "triangle_frame":
        x = _unit(np.cross(e, _unit(across)))
        frame = np.stack([x, _unit(np.cross(e, x)), _unit(e)], axis=-1)
        return TriangleShape(frame, np.linalg.norm(across, axis=1) / 2)
    a0 = _unit(e)
    a1 = _unit(np.cross(a0, f))
    a2 = -_unit(np.cross(a1, a0))
    size = (np.linalg.norm(e, axis=1) + np.abs(np.sum(a2 * f, axis=1))) / 2
    return TriangleShape(np.stack([a0, a1, a2], axis=-1), size)


def vertex_normals(surface: Surface, vertices: F32) -> F64:
    """[V, 3] sums of edge x edge over a vertex's triangles, divided by max(length, normal_floor / u^2).

    The floor is an area in training units: on a fine mesh in metres it leaves normals shorter than 1.
    """
    corner = vertices.astype(np.float64)[surface.embedding.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return _floored(surface, across, float(constants()["normal_floor"]))


def vertex_quaternions(surface: Surface, shape: TriangleShape) -> F64:
    """[V, 4] wxyz: canonical area times triangle quaternion, summed, divided by max(length, quaternion_floor / u^2)."""
    area = surface.canonical.size[:, None]
    return _floored(surface, area * triangle_turns(surface, shape), float(constants()["quaternion_floor"]))


def mean_quaternions(surface: Surface, shape: TriangleShape) -> F64:
    """[V, 4] wxyz: triangle quaternions averaged by canonical area, at most 1 long (SplattingAvatar's Eq. 5).

    0 for a vertex that no triangle with an area has.
    """
    area = surface.canonical.size[:, None]
    turn = _summed(surface, area * triangle_turns(surface, shape))
    result: F64 = turn / np.maximum(_summed(surface, area), TINY)
    return result


def triangle_turns(surface: Surface, shape: TriangleShape) -> F64:
    """[F, 4] wxyz: posed frame times inverse canonical frame, signed by the policy alone.

    Neighbours of opposite sign cancel in a sum, as they do in the released code.
    """
    turn = shape.frame @ np.swapaxes(surface.canonical.frame, -1, -2)
    return SIGNED[surface.rules.quaternion_sign](turn)


def _floored(surface: Surface, by_triangle: F64, floor: float) -> F64:
    """[V, ...] sums over each vertex's triangles, divided by their length, or by the floor where that is larger."""
    total = _summed(surface, by_triangle)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    result: F64 = total / np.maximum(length, floor / surface.training_per_bundle**2)
    return result


def _summed(surface: Surface, by_triangle: F64) -> F64:
    """[V, ...] sums over each vertex's triangles."""
    total = np.zeros((len(surface.vertex_triangle_ptr) - 1, by_triangle.shape[1]))
    ptr = surface.vertex_triangle_ptr.astype(np.int64)
    used = np.flatnonzero(ptr[1:] > ptr[:-1])
    if len(used):
        total[used] = np.add.reduceat(by_triangle[surface.vertex_triangle], ptr[used], axis=0)
    return total


def _interpolated(surface: Surface, by_vertex: F64) -> F64:
    """[N, ...] barycentric sums of a vertex quantity."""
    weight = surface.embedding.barycentric.astype(np.float64)
    result: F64 = np.einsum("nc,nc...->n...", weight, by_vertex[surface.embedding.vertex_ids])
    return result


def _unit(v: F64) -> F64:
    result: F64 = v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), TINY)
    return result


def _along_normal(surface: Surface, vertices: F32, shape: TriangleShape) -> F64:
    """x = P + d n, n the interpolated vertex normal made unit."""
    return _above(surface, vertices, _unit(_interpolated(surface, vertex_normals(surface, vertices))))


def _along_interpolated_normal(surface: Surface, vertices: F32, shape: TriangleShape) -> F64:
    """x = P + d n, n the interpolated vertex normal as it is (SplattingAvatar's Eq. 2 and 3)."""
    return _above(surface, vertices, _interpolated(surface, vertex_normals(surface, vertices)))


def _above(surface: Surface, vertices: F32, normal: F64) -> F64:
    foot = _interpolated(surface, vertices.astype(np.float64))
    result: F64 = foot + surface.embedding.displacement[:, None] * normal
    return result


def _in_triangle(surface: Surface, vertices: F32, shape: TriangleShape) -> F64:
    """x = P + k F o."""
    at = surface.embedding.triangle
    offset = np.einsum("nij,nj->ni", shape.frame[at], surface.embedding.local_offset)
    result: F64 = _interpolated(surface, vertices.astype(np.float64)) + shape.size[at, None] * offset
    return result


def _by_vertices(surface: Surface, shape: TriangleShape, vertex_matrix: F32 | None) -> F64:
    return _interpolated(surface, vertex_quaternions(surface, shape))


def _by_vertex_means(surface: Surface, shape: TriangleShape, vertex_matrix: F32 | None) -> F64:
    return _interpolated(surface, mean_quaternions(surface, shape))


def _by_triangle(surface: Surface, shape: TriangleShape, vertex_matrix: F32 | None) -> F64:
    result: F64 = quat_from_matrix(shape.frame)[surface.embedding.triangle]
    return result


def _by_joints(surface: Surface, shape: TriangleShape, vertex_matrix: F32 | None) -> F64:
    """quat(polar3(sum_c b_c M_c)) of the corners' skin matrices M (PSAvatar's Eq. 11)."""
    assert vertex_matrix is not None
    result: F64 = quat_from_matrix(polar(_interpolated(surface, vertex_matrix.astype(np.float64))))
    return result


def _w_positive(turn: F64) -> F64:
    quat = quat_from_matrix(turn)
    return np.where(quat[:, :1] < 0, -quat, quat)


def _largest_positive(turn: F64) -> F64:
    result: F64 = quat_from_matrix(turn)
    return result


def _largest_positive_mirrored(turn: F64) -> F64:
    """largest_positive in the other frame: negative if y or z is the largest."""
    return mirrored_quats(_largest_positive(mirrored_matrices(turn)))


def _same_scale(surface: Surface, shape: TriangleShape, log_scale: F32) -> F32:
    return log_scale


def _log_area(surface: Surface, shape: TriangleShape, log_scale: F32) -> F32:
    """The damped ratio of areas multiplies the logarithm of the scale in training units."""
    u, at = surface.training_per_bundle, surface.embedding.triangle
    damping = float(constants()["area_damping"]) / u**2
    ratio = (shape.size[at] + damping) / (surface.canonical.size[at] + damping)
    result: F32 = ((log_scale + np.log(u)) * ratio[:, None] - np.log(u)).astype(np.float32)
    return result


def _linear(surface: Surface, shape: TriangleShape, log_scale: F32) -> F32:
    """The ratio of sizes, areas or edge lengths, multiplies the scale."""
    at = surface.embedding.triangle
    growth = np.log(np.maximum(shape.size[at], TINY) / surface.canonical.size[at])
    result: F32 = (log_scale + growth[:, None]).astype(np.float32)
    return result


SIGNED = {
    "w_positive": _w_positive,
    "largest_positive": _largest_positive,
    "largest_positive_mirrored": _largest_positive_mirrored,
}
POSITIONS = {
    "normal": _along_normal,
    "interpolated_normal": _along_interpolated_normal,
    "triangle_frame": _in_triangle,
}
TURNS = {
    "vertex_quaternion": _by_vertices,
    "vertex_quaternion_mean": _by_vertex_means,
    "triangle_frame": _by_triangle,
    "bary_vertex_lbs": _by_joints,
}
SCALES = {"none": _same_scale, "log_area": _log_area, "linear_area": _linear, "triangle_linear": _linear}
