"""Stage `bind`: carries the blended Gaussians along with joints and mesh, group by group."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from avatar_runtime.avatar import F32, F64, U32, Avatar, Gaussians, Group, Rules, SparseRows
from avatar_runtime.rotation import homogeneous, polar, quat_from_matrix, quat_multiply
from avatar_runtime.stages.joints import Joints
from avatar_runtime.stages.skin import transform
from avatar_runtime.stages.sparse import combine, gather
from avatar_runtime.stages.surface import Surface, carry


@dataclass(frozen=True)
class Bound:
    """Gaussians in world space, still in training space otherwise; colour is seen along rotation^T d."""

    gaussians: Gaussians
    rotation: F32  # [N, 3, 3] world from the frame in which the SH were trained


def bind(
    avatar: Avatar,
    blended: Gaussians,
    state: Joints | None,  # None without a rig
    late_weights: F32,
    anchor_vertices: F32 | None,  # [A, 3] posed anchor vertices, repeats kept
    world_from_avatar: F64,  # [4, 4] rigid
) -> Bound:
    """Position, rotation and SH frame of every Gaussian by its group's binding."""
    n = blended.count
    matrix = np.tile(np.eye(3, 4, dtype=np.float32), (n, 1, 1))
    rotation = np.tile(np.eye(3, dtype=np.float32), (n, 1, 1))
    mean = blended.mean
    late = combine(avatar.blendshapes.late_morphs, late_weights)["mean"]
    if state is not None:
        mean = mean + combine(avatar.blendshapes.correctives, state.pose_feature)["mean"]
        for group in avatar.groups:
            rows = slice(group.first, group.first + group.count)
            matrix[rows], rotation[rows] = _group_transform(avatar, group, state, anchor_vertices)
    turned = quat_multiply(quat_from_matrix(rotation), blended.quat_wxyz)
    moved = replace(blended, mean=transform(matrix, mean) + late, quat_wxyz=turned)
    return _place(Bound(moved, _seen(avatar.rules, rotation)), world_from_avatar)


def bind_surface(
    surface: Surface,
    blended: Gaussians,
    vertices: F32,  # [V, 3] posed mesh
    world_from_avatar: F64,  # [4, 4] rigid
) -> Bound:
    """Position, rotation, scale and SH frame of Gaussians that ride on a mesh."""
    carried = carry(surface, vertices, blended.log_scale)
    moved = replace(blended, mean=carried.mean, quat_wxyz=carried.quat_wxyz, log_scale=carried.log_scale)
    return _place(Bound(moved, _seen(surface.rules, carried.rotation)), world_from_avatar)


def _seen(rules: Rules, rotation: F32) -> F32:
    """The frame in which SH are evaluated, by rules.sh_direction."""
    if rules.sh_direction == "world":
        return np.tile(np.eye(3, dtype=np.float32), (len(rotation), 1, 1))
    return rotation


def _group_transform(avatar: Avatar, group: Group, state: Joints, anchors: F32 | None) -> tuple[F32, F32]:
    """([count | 1, 3, 4] position transform, [count | 1, 3, 3] rotation) of one group."""
    if group.binding == "skin":
        return _skin_transform(avatar, group, state)
    if group.binding == "anchor":
        if avatar.rig is None or anchors is None:
            raise ValueError("an anchor group needs the posed anchor vertices")
        fit = anchor_transform(avatar.rig.vertices, avatar.rig.anchor_vertices, anchors, avatar.rules.anchor)
        return fit[None, :3], fit[None, :3, :3]
    if group.binding == "joint_mix":
        mix = joint_mix(avatar, group, state)[None]
        return mix[:, :3], polar(mix[:, :3, :3])
    return np.eye(3, 4, dtype=np.float32)[None], np.eye(3, dtype=np.float32)[None]


def _skin_transform(avatar: Avatar, group: Group, state: Joints) -> tuple[F32, F32]:
    matrix = gather(rows_of(avatar.skin, group.first, group.count), state.skin_matrix[:, :3])
    if avatar.rules.rotation == "polar3":
        return matrix, polar(matrix[:, :, :3])
    if avatar.rules.rotation == "head_bone":
        assert avatar.rig is not None and avatar.rules.rotation_joint is not None
        joint = avatar.rig.joint_names.index(avatar.rules.rotation_joint)
        return matrix, polar(state.skin_matrix[joint, :3, :3])[None]
    return matrix, np.eye(3, dtype=np.float32)[None]


def anchor_transform(vertices: F32, anchor_vertices: U32, posed: F32, rule: str) -> F32:
    """Rigid fit (Kabsch) of the anchor vertices, neutral to posed, [4, 4].

    `vertices` [V, 3] neutral, `anchor_vertices` [A] indices into it, `posed` [A, 3] in their order.
    Rule `repeats` weights a vertex by how often it stands in the list (GaussianBlendshapes 2952da7,
    mouth_gs_model.py); `unique` takes it once (its C++ viewer, FaceViewer 61965e9).
    """
    a, b = vertices[anchor_vertices].astype(np.float64), posed.astype(np.float64)
    if rule == "unique":
        _, first = np.unique(anchor_vertices, return_index=True)
        a, b = a[first], b[first]
    ca, cb = a.mean(axis=0), b.mean(axis=0)
    u, _, vt = np.linalg.svd((a - ca).T @ (b - cb))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))])
    r = vt.T @ sign @ u.T
    return homogeneous(r, cb - r @ ca).astype(np.float32)


def joint_mix(avatar: Avatar, group: Group, state: Joints) -> F32:
    """I + M - M_neutral with M = sum_j c_j A_j, [4, 4]; what the factors leave of 1 stays on the identity."""
    assert avatar.rig is not None
    factors = np.zeros(avatar.rig.joint_count)
    for name, factor in group.joint_mix.items():
        factors[avatar.rig.joint_names.index(name)] = factor
    mixed = np.tensordot(factors, state.skin_matrix.astype(np.float64), axes=1)
    result: F32 = (mixed + (1 - factors.sum()) * np.eye(4)).astype(np.float32)
    return result


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
