"""Pairs of points that lie close together, without a search tree."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F64, I64
from avatar_runtime.rotation import matrix_from_rotvec

CURVES = 8  # differently rotated and shifted
AHEAD = 3  # points along a curve that a point is paired with
BITS = 16  # of each coordinate along a curve
SEED = 5


def close_pairs(points: F64, label: npt.NDArray[np.integer]) -> I64:
    """[P, 2] index pairs, smaller first, unique and sorted, of points [N, 3] with the same `label` [N].

    Each point is paired with its followers on several space-filling curves (Morton order of rotated, shifted
    points), which finds nearly all nearest neighbours in N log N.
    """
    rng = np.random.default_rng(SEED)
    n = len(points)
    low = points.min(axis=0)
    size = max(float((points - low).max()), 1e-30)
    found = []
    for turn, shift in zip(rng.normal(0, 2, (CURVES, 3)), rng.uniform(0, 1, (CURVES, 3)), strict=True):
        turned = ((points - low) / size - 0.5) @ matrix_from_rotvec(turn).T
        cell = ((turned + 1 + shift) / 3 * (2**BITS - 1)).astype(np.uint64)
        code = _spread(cell[:, 0]) | _spread(cell[:, 1]) << np.uint64(1) | _spread(cell[:, 2]) << np.uint64(2)
        order = np.lexsort((code, label))
        for step in range(1, min(AHEAD, n - 1) + 1):
            a, b = order[:-step], order[step:]
            same = label[a] == label[b]
            found.append(np.minimum(a, b)[same] * n + np.maximum(a, b)[same])
    key = np.unique(np.concatenate(found)) if found else np.zeros(0, np.int64)
    return np.stack([key // n, key % n], axis=1)


def _spread(x: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """The bits of 16-bit numbers, three places apart."""
    for shift, mask in ((16, 0xFF0000FF), (8, 0x0F00F00F00F), (4, 0x0C30C30C30C3), (2, 0x249249249249)):
        x = (x | x << np.uint64(shift)) & np.uint64(mask)
    return x
