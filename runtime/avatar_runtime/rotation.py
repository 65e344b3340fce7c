"""Rotations as quaternions (w, x, y, z), matrices and rotation vectors; batched over leading axes."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_schema import constants

Array = npt.NDArray[Any]


def quat_multiply(a: Array, b: Array) -> Array:
    """Hamilton product a b, wxyz; [..., 4] each."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )


def matrix_from_quat(q: Array) -> Array:
    """Rotation matrices [..., 3, 3] of unit quaternions wxyz [..., 4]."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quat_from_matrix(m: Array) -> Array:
    """Unit quaternions wxyz [..., 4] of rotation matrices [..., 3, 3]; the largest component is positive.

    The sign policy of pytorch3d before 0.7.6, which Gaussian Blendshapes trains with.
    """
    d0, d1, d2 = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    squares = np.stack([1 + d0 + d1 + d2, 1 + d0 - d1 - d2, 1 - d0 + d1 - d2, 1 - d0 - d1 + d2], axis=-1)
    size = np.sqrt(np.maximum(squares, 0))
    a, b, c = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    d, e, f = m[..., 1, 0] + m[..., 0, 1], m[..., 0, 2] + m[..., 2, 0], m[..., 2, 1] + m[..., 1, 2]
    w2, x2, y2, z2 = np.moveaxis(size**2, -1, 0)
    candidates = np.stack(
        [
            np.stack([w2, a, b, c], axis=-1),
            np.stack([a, x2, d, e], axis=-1),
            np.stack([b, d, y2, f], axis=-1),
            np.stack([c, e, f, z2], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(size, axis=-1)[..., None]
    chosen = np.take_along_axis(candidates, best[..., None], axis=-2)[..., 0, :]
    result: Array = chosen / (2 * np.take_along_axis(size, best, axis=-1))
    return result


def inverse_transpose(m: Array) -> Array:
    """Inverse transpose of [..., 3, 3] by cross products of rows."""
    r0, r1, r2 = m[..., 0, :], m[..., 1, :], m[..., 2, :]
    cofactors = np.stack([np.cross(r1, r2), np.cross(r2, r0), np.cross(r0, r1)], axis=-2)
    determinant = np.sum(r0 * cofactors[..., 0, :], axis=-1)
    result: Array = cofactors / determinant[..., None, None]
    return result


def polar(m: Array) -> Array:
    """Rotation factor of [..., 3, 3] by the trainer's three Newton steps R <- (R + R^-T) / 2."""
    for _ in range(int(constants()["polar_steps"])):
        m = (m + inverse_transpose(m)) * m.dtype.type(0.5)
    return m


def matrix_from_rotvec(rotvec: Array) -> Array:
    """Rotation matrices [..., 3, 3] of rotation vectors [..., 3] (axis times angle, radians)."""
    rotvec = np.asarray(rotvec, np.float64)
    angle = np.linalg.norm(rotvec, axis=-1, keepdims=True)
    axis = rotvec / np.where(angle > 0, angle, 1)
    return matrix_from_quat(np.concatenate([np.cos(angle / 2), np.sin(angle / 2) * axis], axis=-1))


def homogeneous(linear: Array, translation: Array | None = None) -> Array:
    """[..., 4, 4] from a linear part [..., 3, 3] and a translation [..., 3]."""
    m = np.zeros((*linear.shape[:-2], 4, 4), linear.dtype)
    m[..., :3, :3] = linear
    if translation is not None:
        m[..., :3, 3] = translation
    m[..., 3, 3] = 1
    return m


def translation_matrix(offset: Array) -> Array:
    """[..., 4, 4] that moves by `offset` [..., 3]."""
    offset = np.asarray(offset)
    return homogeneous(np.broadcast_to(np.eye(3, dtype=offset.dtype), (*offset.shape[:-1], 3, 3)), offset)
