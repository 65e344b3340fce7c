"""The sizes of the first Gaussians: searched for neighbours against all distances."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from avatar_runtime.avatar import F64
from avatar_trainer.systems.common import first_points
from avatar_trainer.systems.common.first_points import LEAST_SCALE, neighbour_scale
from avatar_trainer.systems.common.poisson import neighbour_distance


def sphere(count: int) -> F64:
    points = np.random.default_rng(5).normal(size=(count, 3))
    unit: F64 = points / np.linalg.norm(points, axis=1, keepdims=True)
    return unit


def among_all(points: F64) -> F64:
    """By all distances."""
    apart = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    nearest: F64 = np.sqrt(np.sort(apart, axis=1)[:, 1:4].mean(axis=1))
    return nearest


CLOUDS = {
    "sphere": sphere(700),
    "many in one place": np.concatenate([np.zeros((50, 3)), sphere(100)]),
    "a line": np.random.default_rng(1).random((200, 1)) * [0.0, 0.0, 1.0],
    "a plane across x": np.random.default_rng(2).random((300, 3)) * [0.0, 1.0, 1.0],
    "four": sphere(4),
}


@pytest.mark.parametrize("name", CLOUDS)
def test_searched_neighbours_are_the_nearest(name: str) -> None:
    assert neighbour_distance(CLOUDS[name]) == pytest.approx(among_all(CLOUDS[name]), rel=1e-14)


@pytest.mark.parametrize("searched", [1, 10**9])
def test_first_scales_either_way(searched: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(first_points, "SEARCHED", searched)
    points = torch.from_numpy(CLOUDS["many in one place"].astype(np.float32))
    scale = neighbour_scale(points)
    assert scale.dtype == torch.float32 and scale[0] == np.float32(LEAST_SCALE)
    expected = among_all(points.double().numpy())[50:]
    assert scale[50:].numpy() == pytest.approx(expected, rel=1e-6)
