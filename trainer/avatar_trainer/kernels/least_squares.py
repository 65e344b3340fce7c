"""Small least squares: normal equations of points with three rows each, and their bounded solution.

One thread in the order stored: the same bits on every machine and for every number of threads.
"""

from __future__ import annotations

import numpy as np

from avatar_runtime import F64
from avatar_runtime.backends.cpu import kernel

SWEEPS = 60


@kernel()
def normal_matrix(
    slope: F64,  # [V, 3, D] movement of each point by each parameter
    weight: F64,  # [V, 3, 3] symmetric
    out: F64,  # [D, D] zeros, changed
) -> None:
    """The sum over points of slope^T weight slope."""
    count, _, d = slope.shape
    pulled = np.empty((3, d))
    for v in range(count):
        for c in range(3):
            for k in range(d):
                pulled[c, k] = (
                    weight[v, c, 0] * slope[v, 0, k]
                    + weight[v, c, 1] * slope[v, 1, k]
                    + weight[v, c, 2] * slope[v, 2, k]
                )
        for i in range(d):
            for c in range(3):
                left = slope[v, c, i]
                if left != 0:  # most expressions do not move most points
                    for k in range(i, d):
                        out[i, k] += left * pulled[c, k]
    for i in range(d):
        for k in range(i):
            out[i, k] = out[k, i]


@kernel()
def bounded_solution(matrix: F64, right: F64, low: F64, high: F64, x: F64) -> None:
    """Minimises x^T matrix x / 2 - right^T x with low <= x <= high by descent along coordinates; x is changed."""
    d = len(x)
    for _ in range(SWEEPS):
        for i in range(d):
            if matrix[i, i] <= 0:
                continue
            rest = right[i]
            for k in range(d):
                rest -= matrix[i, k] * x[k]
            x[i] = min(max(x[i] + rest / matrix[i, i], low[i]), high[i])
