"""The nearest other points of each point of a set."""

from __future__ import annotations

import numpy as np
from numba import prange

from avatar_runtime import F64, I64
from avatar_runtime.backends.cpu import kernel


def nearest_others(position: F64, count: int) -> I64:
    """[N, min(count, N - 1)] int64: the nearest other points of each point [N, 3], the nearest first.

    Of equally distant ones any. Points are sorted along the longest axis; a search ends where that axis alone is too
    far.
    """
    count = max(min(count, len(position) - 1), 0)
    if not count:
        return np.zeros((len(position), 0), np.int64)
    axis = int(np.argmax(np.ptp(position, axis=0)))
    order = np.argsort(position[:, axis], kind="stable")
    result = np.empty((len(position), count), np.int64)
    result[order] = order[_swept(np.ascontiguousarray(position[order], np.float64), axis, count)]
    return result


@kernel(parallel=True)
def _swept(position: F64, axis: int, count: int) -> I64:
    """`nearest_others` of points that rise along `axis`."""
    n = len(position)
    result = np.zeros((n, count), np.int64)
    for row in prange(n):
        near = np.full(count, np.inf)
        for step in (-1, 1):
            other = row + step
            while 0 <= other < n and (position[row, axis] - position[other, axis]) ** 2 < near[count - 1]:
                distance = 0.0
                for k in range(3):
                    distance += (position[row, k] - position[other, k]) ** 2
                place = count
                while place > 0 and distance < near[place - 1]:
                    place -= 1
                if place < count:
                    for k in range(count - 1, place, -1):
                        near[k] = near[k - 1]
                        result[row, k] = result[row, k - 1]
                    near[place] = distance
                    result[row, place] = other
                other += step
    return result
