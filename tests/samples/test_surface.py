"""Poisson-disk sampling and deformation gradients against brute force."""

from __future__ import annotations

import itertools

import numpy as np
from samples.subjects.surface import deformation, independent_set, near_pairs, poisson_disk


def test_near_pairs_are_all_pairs() -> None:
    points = np.random.default_rng(0).normal(size=(120, 3))
    i, j, distance = near_pairs(points, 0.6)
    found = {frozenset(p): d for p, d in zip(zip(i.tolist(), j.tolist(), strict=True), distance, strict=True)}
    assert len(found) == len(i)
    for a, b in itertools.combinations(range(120), 2):
        gap = np.linalg.norm(points[a] - points[b])
        assert (gap < 0.6) == (frozenset((a, b)) in found)
        if gap < 0.6:
            assert abs(found[frozenset((a, b))] - gap) < 1e-12


def test_independent_set_is_the_greedy_one() -> None:
    rng = np.random.default_rng(1)
    i, j = rng.integers(0, 60, (2, 150))
    i, j = i[i != j], j[i != j]
    near: dict[int, set[int]] = {k: set() for k in range(60)}
    for a, b in zip(i.tolist(), j.tolist(), strict=True):
        near[a].add(b)
        near[b].add(a)
    greedy: list[int] = []
    for k in range(60):
        if not near[k] & set(greedy):
            greedy.append(k)
    assert np.flatnonzero(independent_set(60, i, j)).tolist() == greedy


def test_poisson_disk_is_exact_in_number_and_well_spread() -> None:
    rng = np.random.default_rng(2)
    points = np.c_[rng.random((3000, 2)), np.zeros(3000)]
    chosen, radius = poisson_disk(points, np.tile((0.0, 0, 1), (3000, 1)), 500, 1.0)
    assert len(set(chosen.tolist())) == 500
    gaps = np.linalg.norm(points[chosen, None] - points[None, chosen], axis=2) + np.eye(500)
    assert gaps.min() >= radius > 0.03
    holes = np.linalg.norm(points[:, None] - points[None, chosen], axis=2).min(axis=1)
    assert holes.max() < 2 * radius


def test_deformation_of_a_turned_stretched_triangle() -> None:
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    stretch = np.array([[1.3, 0.2, 0], [0.2, 0.8, 0], [0, 0, 1]])
    before = np.array([[[0.1, 0.2, 0.3], [0.14, 0.2, 0.3], [0.1, 0.23, 0.3]]])
    after = before @ (turn @ stretch).T + (0.01, 0.02, 0.03)
    point = before.mean(axis=1)
    shift, quat, gradient = deformation(before, after, point)
    np.testing.assert_allclose(point + shift, after.mean(axis=1), atol=1e-12)
    np.testing.assert_allclose(quat, [[np.cos(angle / 2), 0, 0, np.sin(angle / 2)]], atol=1e-9)
    np.testing.assert_allclose(gradient[0][:2, :2], (turn @ stretch)[:2, :2], atol=1e-9)
