"""3x3 algebra on planes: matrices as arrays [F, 9, n] (row-major), so that NumPy works along n Gaussians.

The same formulas as `avatar_runtime.rotation`, some ten times faster for millions of matrices.
"""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32, F64
from avatar_schema import constants


def blended(skin_matrix: F64, weight: F64) -> tuple[F32, F32]:
    """(linear parts [F, 9, n], translations [F, 3, n]) of sum_j w_j A_j; A [F, J, 4, 4], w [n, J]."""
    frames, joints = skin_matrix.shape[:2]
    rows = skin_matrix[:, :, :3].transpose(0, 2, 3, 1)  # [F, 3, 4, J]
    turn = np.matmul(rows[:, :, :3].reshape(frames, 9, joints), weight.T)
    move = np.matmul(rows[:, :, 3], weight.T)
    return turn.astype(np.float32), move.astype(np.float32)


def _cofactors(m: F32) -> F32:
    """[F, 9, n] cofactor matrices."""
    a, b, c, d, e, f, g, h, i = np.moveaxis(m, -2, 0)
    parts = (
        e * i - f * h, f * g - d * i, d * h - e * g,
        c * h - b * i, a * i - c * g, b * g - a * h,
        b * f - c * e, c * d - a * f, a * e - b * d,
    )  # fmt: skip
    return np.stack(parts, axis=-2)


def _determinant(m: F32, cofactor: F32) -> F32:
    result: F32 = (m[..., :3, :] * cofactor[..., :3, :]).sum(axis=-2)
    return result


def unmoved(turn: F32, move: F32, points: F32) -> F32:
    """[F, n, 3]: the points whose images under the blended matrices are `points` [F, n, 3]."""
    cofactor = _cofactors(turn)
    scale = 1 / _determinant(turn, cofactor)
    off = points.transpose(0, 2, 1) - move  # [F, 3, n]
    parts = [
        (cofactor[:, k] * off[:, 0] + cofactor[:, 3 + k] * off[:, 1] + cofactor[:, 6 + k] * off[:, 2]) * scale
        for k in range(3)
    ]
    return np.stack(parts, axis=-1)


def turned(turn: F32, vectors: F32) -> F32:
    """[F, n, 3]: the linear parts [F, 9, n] applied to `vectors` [F, n, 3]."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack(
        [turn[:, 3 * k] * x + turn[:, 3 * k + 1] * y + turn[:, 3 * k + 2] * z for k in range(3)], axis=-1
    )


def rotations(turn: F32) -> F32:
    """[F, 9, n]: rotation factors by the trainer's Newton steps (`rotation.polar`)."""
    for _ in range(int(constants()["polar_steps"])):
        cofactor = _cofactors(turn)
        turn = (turn + cofactor / _determinant(turn, cofactor)[..., None, :]) * np.float32(0.5)
    return turn


def matrices(turn: F32) -> F32:
    """[F, n, 3, 3] from planes [F, 9, n]."""
    frames, _, count = turn.shape
    return np.ascontiguousarray(turn.transpose(0, 2, 1)).reshape(frames, count, 3, 3)


def quaternions(turn: F32) -> F32:
    """[F, n, 4]: unit quaternions wxyz of rotations [F, 9, n], of either sign."""
    a, b, c, d, e, f, g, h, i = np.moveaxis(turn, -2, 0)
    w = 1 + a + e + i
    good = w > 0.1  # elsewhere another component is the divisor
    root = np.sqrt(np.maximum(w, np.float32(0.1)))
    half = np.float32(0.5) / root
    result: F32 = np.stack([root * np.float32(0.5), (h - f) * half, (c - g) * half, (d - b) * half], axis=-1)
    bad = np.nonzero(~good)
    if len(bad[0]):
        result[bad] = _large_turns(*(plane[bad] for plane in (a, b, c, d, e, f, g, h, i)))
    return result


def _large_turns(a: F32, b: F32, c: F32, d: F32, e: F32, f: F32, g: F32, h: F32, i: F32) -> F32:
    """[M, 4]: quaternions of turns near half a revolution, by their largest imaginary component."""
    x2, y2, z2 = 1 + a - e - i, 1 - a + e - i, 1 - a - e + i
    rows = np.stack(
        [
            np.stack([h - f, x2, b + d, c + g], axis=-1),
            np.stack([c - g, b + d, y2, f + h], axis=-1),
            np.stack([d - b, c + g, f + h, z2], axis=-1),
        ],
        axis=1,
    )
    best = np.argmax(np.stack([x2, y2, z2], axis=1), axis=1)
    chosen = rows[np.arange(len(best)), best]
    result: F32 = chosen / np.maximum(np.linalg.norm(chosen, axis=1, keepdims=True), np.float32(1e-12))
    return result


def aligned(quat: F32) -> F32:
    """[F, n, 4] unit quaternions with one sign a Gaussian: along the principal eigenvector of sum q q^T."""
    moment = np.einsum("fni,fnj->nij", quat, quat)
    axis = np.linalg.eigh(moment.astype(np.float64))[1][..., -1].astype(np.float32)  # [n, 4]
    axis *= np.where(axis[:, :1] < 0, np.float32(-1), np.float32(1))
    side = np.einsum("fni,ni->fn", quat, axis)
    result: F32 = quat * np.where(side < 0, np.float32(-1), np.float32(1))[..., None]
    return result
