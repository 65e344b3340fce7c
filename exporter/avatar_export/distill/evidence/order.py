"""The order of the numbers of quaternions, by places alone: Gaussians lie flat on a surface and turn with it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.distill.dumps.folder import Dumps
from avatar_export.distill.dumps.frames import Rows, read_frame
from avatar_export.distill.learn import Task, sample_rows
from avatar_export.notes.note import Note, doubt, fact
from avatar_runtime.avatar import F64, I64
from avatar_runtime.rotation import matrix_from_quat, quat_from_matrix, quat_multiply

FRAMES = 6
NEAR = 8  # neighbours of a Gaussian
FLAT = 0.3  # variance across the surface, over that along it
THIN = 0.5  # log of the middle over the smallest scale
FEWEST = 100  # Gaussians that are judged by
FLATTER, SLIGHTLY = 0.1, 0.03  # cosine of normals and shortest axes, by which the other order is better
HOME = 0.25  # of the squares of w: codes begin with w = 1, and most Gaussians stay near to it
CLEARER = 1.5  # times less is left of the turns of the surface
LEAST_TURN = 1e-3  # mean square, radians, of the turns that say something

INDEX = {"wxyz": [3, 0, 1, 2], "xyzw": [1, 2, 3, 0]}  # stated order: w, x, y, z of the other in what was read
Array = npt.NDArray[Any]
Pair = tuple[F64, F64]  # quaternions in the order that is stated, and in the other


def reordered(dumps: Dumps, quat: Array) -> Array:
    """Decoded quaternions as if the frames had been read in the other order."""
    turn = quat_from_matrix(dumps.turn).astype(quat.dtype)
    result: Array = quat_multiply(turn, _stored(dumps, quat)[..., INDEX[dumps.encoding.quaternion]])
    return result


def _stored(dumps: Dumps, quat: Array) -> Array:
    """Decoded quaternions in the axes of the dumps."""
    turn = quat_from_matrix(dumps.turn).astype(quat.dtype)
    result: Array = quat_multiply(turn * np.array([1, -1, -1, -1], quat.dtype), quat)
    return result


def quaternion_order(task: Task, mended: list[Note], doubts: list[Note]) -> Task:
    """`task` with the order that two of these show: surface, turns, rest rotations. A doubt where one alone does."""
    encoding = task.dumps.encoding
    said, right = encoding.quaternion, "xyzw" if encoding.quaternion == "wxyz" else "wxyz"
    if encoding.scale == "covariance" or task.layout.rows <= NEAR:
        return task
    at = task.fitted[np.unique(np.linspace(0, len(task.fitted) - 1, FRAMES).astype(int))]
    frames = [read_frame(task.dumps, task.layout, int(frame), task.order) for frame in at]
    own = sample_rows(task.layout.rows)
    near = _neighbours(frames[0].mean[0].astype(np.float64), own)
    quats = [rows.quat_wxyz[0, own].astype(np.float64) for rows in frames]
    pairs = [(quat, reordered(task.dumps, quat)) for quat in quats]
    flatter, turning = _flat(frames[0], own, near, pairs[0]), _turning(frames, near, pairs)
    stored = np.square(_stored(task.dumps, quats[0])).mean(axis=0)
    home = stored[INDEX[said][0]] - stored[0] > HOME
    by_surface = flatter > FLATTER or (home and flatter > SLIGHTLY)
    if (by_surface and turning >= 1) or (flatter >= 0 and turning > CLEARER):
        mended.append(fact("quaternion_order", right=right, stated=said))
        return replace(task, dumps=replace(task.dumps, encoding=replace(encoding, quaternion=right)))
    if by_surface or turning > CLEARER or (home and flatter > -SLIGHTLY):
        doubts.append(doubt("quaternion_doubt", right=right, stated=said))
    return task


def _neighbours(points: F64, own: I64) -> I64:
    """[n, NEAR + 1] the Gaussians next to `own`, and these themselves."""
    square = np.square(points).sum(axis=1)
    off = square - 2 * points[own] @ points.T
    return np.argpartition(off, NEAR, axis=1)[:, : NEAR + 1].astype(np.int64)


def _flat(rows: Rows, own: I64, near: I64, quats: Pair) -> float:
    """How much better the shortest axes point along the normals of the surface in the other order."""
    off = rows.mean[0].astype(np.float64)[near]
    off -= off.mean(axis=1, keepdims=True)
    spread, axes = np.linalg.eigh(np.einsum("nka,nkb->nab", off, off))
    scale, thin = np.sort(rows.log_scale[0, own], axis=1), rows.log_scale[0, own].argmin(axis=1)
    judged = (scale[:, 1] - scale[:, 0] > THIN) & (spread[:, 0] < FLAT * spread[:, 1])
    if judged.sum() < FEWEST:
        return 0.0
    stated, other = (
        np.take_along_axis(matrix_from_quat(quat), thin[:, None, None], axis=2)[:, :, 0] for quat in quats
    )
    return float(
        np.abs((axes[:, :, 0] * other).sum(axis=1))[judged].mean()
        - np.abs((axes[:, :, 0] * stated).sum(axis=1))[judged].mean()
    )


def _turning(frames: list[Rows], near: I64, quats: list[Pair]) -> float:
    """How many times less of the turns of the neighbourhoods is left in the other order; 1 where little turns."""
    moved, left = 0.0, np.zeros(2)
    places = [rows.mean[0].astype(np.float64)[near] for rows in frames]
    places = [place - place.mean(axis=1, keepdims=True) for place in places]
    for now, place in zip(quats[1:], places[1:], strict=True):
        u, size, vt = np.linalg.svd(np.einsum("nka,nkb->nab", place, places[0]))
        u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
        judged = size[:, 1] > FLAT / NEAR * size[:, 0]
        turn = _skew(u @ vt)
        moved += (
            float(np.square(turn).sum(axis=1)[judged].mean()) / (len(frames) - 1) if judged.any() else 0.0
        )
        for order in (0, 1):
            a, b = matrix_from_quat(now[order]), matrix_from_quat(quats[0][order])
            left[order] += np.square(turn - _skew(a @ b.swapaxes(-1, -2))).sum(axis=1)[judged].sum()
    return float(left[0] / max(left[1], 1e-12)) if moved > LEAST_TURN else 1.0


def _skew(turns: F64) -> F64:
    """[n, 3] axes of rotations [n, 3, 3], as long as the sine of the angle."""
    return 0.5 * np.stack([turns[:, k - 1, k - 2] - turns[:, k - 2, k - 1] for k in range(3)], axis=1)
