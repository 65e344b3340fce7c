"""Stage `bind`: moves the blended Gaussians with the joints, groups or mesh that they are bound to."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar, Gaussians, Rules, SparseRows
from avatar_runtime.rotation import polar, quat_from_matrix, quat_multiply
from avatar_runtime.stages.groups import GroupTransforms
from avatar_runtime.stages.skin import transform
from avatar_runtime.stages.sparse import combine, gather
from avatar_runtime.stages.surface import Surface, pose_embedded


@dataclass(frozen=True)
class Bound:
    """Gaussians placed in the world, not yet activated; colour is evaluated along rotation^T d."""

    gaussians: Gaussians
    rotation: F32  # [N, 3, 3] world from the frame in which the SH were trained


def bind(
    avatar: Avatar,
    blended: Gaussians,
    skin_matrix: F32,  # [J, 4, 4]; no joints without a rig
    pose_feature: F32,  # [9 C]
    late_weights: F32,  # [L]
    groups: GroupTransforms,
    world_from_avatar: F64,  # [4, 4] rigid
) -> Bound:
    """Position, rotation and SH frame of every Gaussian by its group's binding."""
    n = blended.count
    matrix, rotation = np.empty((n, 3, 4), np.float32), np.empty((n, 3, 3), np.float32)
    for index, group in enumerate(avatar.groups):
        rows = slice(group.first, group.first + group.count)
        matrix[rows], rotation[rows] = groups.matrix[index], groups.rotation[index]
        if group.binding == "skin":
            matrix[rows] = gather(rows_of(avatar.skin, group.first, group.count), skin_matrix[:, :3])
            if avatar.rules.rotation == "polar3":
                rotation[rows] = polar(matrix[rows, :, :3])
    late = combine(avatar.blendshapes.late_morphs, late_weights)["mean"]
    mean = blended.mean + combine(avatar.blendshapes.correctives, pose_feature)["mean"]
    turned = quat_multiply(quat_from_matrix(rotation), blended.quat_wxyz)
    moved = replace(blended, mean=transform(matrix, mean) + late, quat_wxyz=turned)
    return _place(Bound(moved, _seen(avatar.rules, rotation)), world_from_avatar)


def bind_surface(
    surface: Surface,
    blended: Gaussians,
    vertices: F32,  # [V, 3] posed mesh
    world_from_avatar: F64,  # [4, 4] rigid
    vertex_matrix: F32 | None = None,  # [V, 3, 3] linear skin matrices, for rules.RIGGED_ROTATIONS
) -> Bound:
    """Position, rotation, scale and SH frame of embedded Gaussians."""
    posed = pose_embedded(surface, vertices, blended.log_scale, vertex_matrix)
    moved = replace(blended, mean=posed.mean, quat_wxyz=posed.quat_wxyz, log_scale=posed.log_scale)
    return _place(Bound(moved, _seen(surface.rules, posed.rotation)), world_from_avatar)


def _seen(rules: Rules, rotation: F32) -> F32:
    """The frame in which SH are evaluated, by rules.sh_direction."""
    if rules.sh_direction == "world":
        return np.tile(np.eye(3, dtype=np.float32), (len(rotation), 1, 1))
    return rotation


def rows_of(sparse: SparseRows, first: int, count: int) -> SparseRows:
    """Rows first..first+count as views."""
    ptr = sparse.row_ptr[first : first + count + 1]
    entries = slice(int(ptr[0]), int(ptr[-1]))
    values = {name: value[entries] for name, value in sparse.values.items()}
    return SparseRows(ptr - ptr[0], sparse.column[entries], values, sparse.columns)


def _place(bound: Bound, world_from_avatar: F64) -> Bound:
    """Move a bound avatar rigidly; the identity changes no bit."""
    if np.array_equal(world_from_avatar, np.eye(4)):
        return bound
    world = world_from_avatar.astype(np.float32)
    g, r = bound.gaussians, world[:3, :3]
    placed = replace(
        g, mean=transform(world[:3], g.mean), quat_wxyz=quat_multiply(quat_from_matrix(r), g.quat_wxyz)
    )
    return Bound(placed, r @ bound.rotation)
