"""Normals of an avatar that is lit: between the axes of each Gaussian, where they are stored, and avatar space."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from avatar_runtime.avatar import F64, Avatar, Relight
from avatar_runtime.rotation import matrix_from_quat


def bound_normals(avatar: Avatar) -> F64:
    """[N, 3] unit normals in the binding pose."""
    assert avatar.relight is not None
    result: F64 = np.einsum("nij,nj->ni", axes(avatar), avatar.relight.normal.astype(np.float64))
    return result


def with_normals(avatar: Avatar, bound: F64) -> Avatar:
    """`avatar` whose Gaussians face along `bound` [N, 3], of any length, in the binding pose."""
    assert avatar.relight is not None
    normal = unit(np.einsum("nji,nj->ni", axes(avatar), bound)).astype(np.float32)
    return replace(avatar, relight=replace(avatar.relight, normal=normal))


def turned_axes(relight: Relight, turn: F64) -> Relight:
    """The same normals where the axes of each Gaussian are turned: R becomes R `turn`, unit quaternions [N, 4]."""
    normal = np.einsum("nji,nj->ni", matrix_from_quat(turn), relight.normal.astype(np.float64))
    return replace(relight, normal=normal.astype(np.float32))


def axes(avatar: Avatar) -> F64:
    """[N, 3, 3] the axes of each Gaussian in the binding pose, as columns."""
    quat = avatar.gaussians.quat_wxyz.astype(np.float64)
    length = np.linalg.norm(quat, axis=1, keepdims=True)
    result: F64 = matrix_from_quat(
        np.where(length > 0, quat, (1.0, 0, 0, 0)) / np.where(length > 0, length, 1)
    )
    return result


def unit(v: F64) -> F64:
    """Vectors [..., 3] of length 1; what has no length faces +Z."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.where(length > 1e-20, v, (0.0, 0, 1)) / np.where(length > 1e-20, length, 1)
