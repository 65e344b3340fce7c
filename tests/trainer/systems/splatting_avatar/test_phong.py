"""Embedding points of space in a Phong surface (SplattingAvatar Eq. 15)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_trainer.systems.splatting_avatar.phong import PhongSurface, embed
from avatar_trainer.systems.splatting_avatar.walk import neighbours
from tests.measured import Measure

Array = npt.NDArray[Any]
SIDE = 12
UNIT = pytest.mark.parametrize("unit", [True, False], ids=["unit normal", "interpolated normal"])


def dome(unit: bool) -> PhongSurface:
    """A sheet with a border, bent like a cap, about 1 wide."""
    line = np.linspace(-0.5, 0.5, SIDE)
    y, x = np.meshgrid(line, line, indexing="ij")
    vertices = np.stack([x, y, 0.3 * np.cos(2 * x) * np.cos(2 * y)], axis=-1).reshape(-1, 3)
    at = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    a, b, c, d = at[:-1, :-1].ravel(), at[:-1, 1:].ravel(), at[1:, 1:].ravel(), at[1:, :-1].ravel()
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([c, d, a], 1)])
    across = np.cross(
        vertices[triangles[:, 1]] - vertices[triangles[:, 0]],
        vertices[triangles[:, 2]] - vertices[triangles[:, 0]],
    )
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, triangles[:, k], across)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return PhongSurface(neighbours(triangles), triangles, vertices, normals, unit)


def displaced(surface: PhongSurface, triangle: Array, barycentric: Array, displacement: Array) -> Array:
    """V + d N of each row, one at a time."""
    points = []
    for k, b, d in zip(triangle, barycentric, displacement, strict=True):
        corners = surface.triangles[k]
        normal = sum(b[j] * surface.normals[corners[j]] for j in range(3))
        if surface.unit_normal:
            normal = normal / np.sqrt(normal @ normal)
        points.append(sum(b[j] * surface.vertices[corners[j]] for j in range(3)) + d * normal)
    return np.array(points)


@UNIT
def test_points_above_the_surface_are_found_from_far_away(unit: bool, measured: Measure) -> None:
    """From anywhere on the sheet: the descent walks over up to a dozen triangles."""
    surface, rng = dome(unit), np.random.default_rng(0)
    count = 300
    inner = np.flatnonzero((np.abs(surface.vertices[surface.triangles][:, :, :2]) < 0.4).all(axis=(1, 2)))
    triangle, barycentric = rng.choice(inner, count), rng.dirichlet([1, 1, 1], count)
    displacement = rng.uniform(-0.05, 0.05, count)
    points = displaced(surface, triangle, barycentric, displacement)
    start = rng.choice(inner, count)
    found = embed(surface, points, start, np.full((count, 3), 1 / 3), np.zeros(count))
    again = displaced(surface, found.triangle, found.barycentric, found.displacement)
    apart = np.linalg.norm(again - points, axis=1)
    measured("embedding of a point above a surface", float(apart.max()))
    assert apart.max() < 1e-6
    np.testing.assert_allclose(found.distance, apart, atol=1e-12)
    assert (found.triangle != start).mean() > 0.9
    assert (found.barycentric >= 0).all()
    np.testing.assert_allclose(found.displacement, displacement, atol=1e-5)
    assert (found.triangle == triangle).mean() > 0.99  # else beside an edge


@UNIT
def test_beyond_the_border_nothing_is_nearer(unit: bool, measured: Measure) -> None:
    """The nearest of very many points tried all over the sheet."""
    surface, rng = dome(unit), np.random.default_rng(1)
    points = np.array([[0.7, 0.1, 0.1], [-0.6, -0.2, 0.3], [0.1, 0.65, 0.0]])
    found = embed(surface, points, np.array([0, 50, 100]), np.full((3, 3), 1 / 3), np.zeros(3))
    apart = np.linalg.norm(
        displaced(surface, found.triangle, found.barycentric, found.displacement) - points, axis=1
    )
    np.testing.assert_allclose(found.distance, apart, atol=1e-12)
    for row in range(3):
        edge = np.argsort(
            np.linalg.norm(surface.vertices[surface.triangles].mean(axis=1) - points[row], axis=1)
        )[:20]
        tried, at = rng.dirichlet([0.3, 0.3, 0.3], 20_000), rng.choice(edge, 20_000)
        lift = found.displacement[row] + rng.normal(0, 0.03, 20_000)
        nearest = np.linalg.norm(displaced(surface, at, tried, lift) - points[row], axis=1).min()
        measured("how much nearer a random point is than the embedding", float(apart[row] - nearest))
        assert apart[row] < nearest + 1e-6


def test_a_point_that_is_there_already_stays() -> None:
    surface = dome(True)
    barycentric = np.array([[0.2, 0.3, 0.5]])
    point = displaced(surface, np.array([30]), barycentric, np.array([0.02]))
    found = embed(surface, point, np.array([30]), barycentric, np.array([0.02]))
    assert found.triangle[0] == 30
    np.testing.assert_allclose(found.barycentric, barycentric, atol=1e-12)
    assert found.displacement[0] == 0.02
