"""Part of stage `joints`: one rigid or mixed transform for each group of Gaussians. Small, on the CPU."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F32, U32, Avatar, Group
from avatar_runtime.rotation import homogeneous, polar
from avatar_runtime.stages.joints import Joints


@dataclass(frozen=True)
class GroupTransforms:
    """One transform a group, mesh from binding mesh; the identity where no transform moves the whole group.

    A `skin` group has a matrix of its own for every Gaussian; only rotation rule `head_bone` gives it a
    rotation here.
    """

    matrix: F32  # [G, 3, 4] of positions
    rotation: F32  # [G, 3, 3] of quaternions and of SH


def group_transforms(avatar: Avatar, state: Joints | None, anchor_vertices: F32 | None) -> GroupTransforms:
    """Every group's transform; `state` is None without a rig.

    `anchor_vertices` [A, 3] are the posed anchor vertices, repeats kept. Raises ValueError if a group needs
    them and they are missing.
    """
    matrix = np.tile(np.eye(3, 4, dtype=np.float32), (len(avatar.groups), 1, 1))
    rotation = np.tile(np.eye(3, dtype=np.float32), (len(avatar.groups), 1, 1))
    if state is not None:
        for index, group in enumerate(avatar.groups):
            if group.binding == "anchor":
                matrix[index] = _anchor(avatar, anchor_vertices)[:3]
                rotation[index] = matrix[index, :, :3]
            elif group.binding == "joint_mix":
                matrix[index] = joint_mix(avatar, group, state)[:3]
                rotation[index] = polar(matrix[index, :, :3])
            elif group.binding == "skin" and avatar.rules.rotation == "head_bone":
                assert avatar.rig is not None and avatar.rules.rotation_joint is not None
                joint = avatar.rig.joint_names.index(avatar.rules.rotation_joint)
                rotation[index] = polar(state.skin_matrix[joint, :3, :3])
    return GroupTransforms(matrix, rotation)


def _anchor(avatar: Avatar, posed: F32 | None) -> F32:
    if avatar.rig is None or posed is None:
        raise ValueError("an anchor group needs the posed anchor vertices")
    return anchor_transform(avatar.rig.vertices, avatar.rig.anchor_vertices, posed, avatar.rules.anchor)


def anchor_transform(vertices: F32, anchor_vertices: U32, posed: F32, rule: str) -> F32:
    """Rigid fit (Kabsch) of the anchor vertices, neutral to posed, [4, 4].

    `vertices` [V, 3] neutral, `anchor_vertices` [A] indices into it, `posed` [A, 3] in their order.
    Rule `repeats` weights a vertex by how often it is listed (GaussianBlendshapes 2952da7, mouth_gs_model.py);
    `unique` takes it once (its C++ viewer, FaceViewer 61965e9). NaN if a posed vertex is not finite.
    """
    a, b = vertices[anchor_vertices].astype(np.float64), posed.astype(np.float64)
    if not np.isfinite(b).all():  # vertices beyond float32: nothing of the group is drawn
        return np.full((4, 4), np.nan, np.float32)
    if rule == "unique":
        _, first = np.unique(anchor_vertices, return_index=True)
        a, b = a[first], b[first]
    ca, cb = a.mean(axis=0), b.mean(axis=0)
    u, _, vt = np.linalg.svd((a - ca).T @ (b - cb))
    sign = np.diag([1.0, 1.0, np.sign(np.linalg.det(vt.T @ u.T))])
    r = vt.T @ sign @ u.T
    return homogeneous(r, cb - r @ ca).astype(np.float32)


def joint_mix(avatar: Avatar, group: Group, state: Joints) -> F32:
    """I + M - M_neutral with M = sum_j c_j A_j, [4, 4]; the rest of the factors' sum to 1 goes to the identity."""
    assert avatar.rig is not None
    factors = np.zeros(avatar.rig.joint_count)
    for name, factor in group.joint_mix.items():
        factors[avatar.rig.joint_names.index(name)] = factor
    mixed = np.tensordot(factors, state.skin_matrix.astype(np.float64), axes=1)
    result: F32 = (mixed + (1 - factors.sum()) * np.eye(4)).astype(np.float32)
    return result
