"""Normal equations are the sums that they are defined as; bounded solutions are the least that keep to the bounds."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from avatar_trainer.kernels.least_squares import bounded_solution, normal_matrix


def test_the_normal_matrix_is_its_sum() -> None:
    rng = np.random.default_rng(0)
    slope, half = rng.normal(size=(40, 3, 7)), rng.normal(size=(40, 3, 3))
    slope[::3, :, 2:5] = 0
    weight, found = half @ half.transpose(0, 2, 1), np.zeros((7, 7))
    normal_matrix(slope, weight, found)
    assert found == pytest.approx(np.einsum("vci,vcd,vdj->ij", slope, weight, slope), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_a_bounded_solution_is_the_least(seed: int) -> None:
    """Of all choices of which unknowns stand at which bound, the best one that keeps to the bounds."""
    rng, size = np.random.default_rng(seed), 4
    half, right = rng.normal(size=(size, size)), 2 * rng.normal(size=size)
    matrix = half @ half.T + 0.5 * np.eye(size)
    low, high, found = np.full(size, -0.4), np.full(size, 0.6), np.zeros(size)
    bounded_solution(matrix, right, low, high, found)
    best = np.inf
    for stands in product((-1, 0, 1), repeat=size):
        at = np.array(stands)
        x = np.where(at < 0, low, high)
        free = at == 0
        if free.any():
            rest = right[free] - matrix[np.ix_(free, ~free)] @ x[~free]
            x[free] = np.linalg.solve(matrix[np.ix_(free, free)], rest)
        if (x >= low - 1e-9).all() and (x <= high + 1e-9).all():
            best = min(best, float(x @ matrix @ x / 2 - right @ x))
    assert found @ matrix @ found / 2 - right @ found == pytest.approx(best, abs=1e-6)
    assert (found >= low).all() and (found <= high).all()
