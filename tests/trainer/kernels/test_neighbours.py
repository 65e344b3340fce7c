"""The nearest other points, against all distances."""

from __future__ import annotations

import numpy as np

from avatar_trainer.kernels.neighbours import nearest_others


def test_the_nearest_others_are_those_of_all_distances() -> None:
    place = np.random.default_rng(1).normal(size=(60, 3))
    apart = np.linalg.norm(place[:, None] - place, axis=2) + np.diag(np.full(60, np.inf))
    assert np.array_equal(nearest_others(place, 8), np.argsort(apart, axis=1)[:, :8])
    assert nearest_others(place[:3], 8).shape == (3, 2)
    assert nearest_others(place[:1], 8).shape == (1, 0)
