"""Embedding points of space in a Phong surface (SplattingAvatar Eq. 15)."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_trainer.normals import vertex_normals
from avatar_trainer.systems.splatting_avatar.phong import PhongSurface, embed
from avatar_trainer.systems.splatting_avatar.walk import neighbours
from tests.measured import Measure
from tests.trainer.systems.splatting_avatar.scene import sheet

Array = npt.NDArray[Any]
SIDE = 12


def dome(unit: bool) -> PhongSurface:
    """A sheet with a border, bent like a cap, about 1 wide."""
    line = np.linspace(-0.5, 0.5, SIDE)
    y, x = np.meshgrid(line, line, indexing="ij")
    vertices = np.stack([x, y, 0.3 * np.cos(2 * x) * np.cos(2 * y)], axis=-1).reshape(-1, 3)
    triangles = sheet(SIDE)
    return PhongSurface(neighbours(triangles), triangles, vertices, vertex_normals(vertices, triangles), unit)


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


@pytest.mark.parametrize("unit", [True, False], ids=["unit normal", "interpolated normal"])
def test_beyond_the_border_nothing_is_nearer(unit: bool, measured: Measure) -> None:
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
