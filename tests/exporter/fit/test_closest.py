"""The nearest points of a mesh against trimesh, which computes every pair."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from avatar_export.fit.closest import Triangles

SCALES = (1e-3, 1.0, 1e3)


def _mesh(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A ball with uneven triangles, one of them without area."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = ball.vertices * np.random.default_rng(seed).uniform(0.2, 1.5, (len(ball.vertices), 1))
    faces = np.vstack([ball.faces, [[5, 5, 9]]])
    return vertices, faces.astype(np.uint32)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("away", [0.0, 200.0])
def test_distances_and_places(scale: float, away: float) -> None:
    vertices, faces = _mesh(3)
    points = np.random.default_rng(4).normal(0, 1, (300, 3)) + away
    found = Triangles.of(scale * vertices, faces).nearest(scale * points)
    plain = trimesh.Trimesh(vertices, faces[:-1], process=False)
    _, want, _ = trimesh.proximity.closest_point_naive(plain, points)
    tolerance = 64 * np.finfo(np.float64).eps * scale * (2 + away)
    np.testing.assert_allclose(found.distance, scale * want, atol=tolerance, rtol=0)
    places = np.einsum("ij,ijk->ik", found.barycentric, scale * vertices[faces[found.triangle]])
    np.testing.assert_allclose(
        np.linalg.norm(scale * points - places, axis=1), found.distance, atol=tolerance
    )
    assert (found.barycentric > -1e-12).all()


def test_no_points() -> None:
    vertices, faces = _mesh(1)
    assert Triangles.of(vertices, faces).nearest(np.zeros((0, 3))).distance.shape == (0,)


def test_numbers_of_any_size() -> None:
    vertices, faces = _mesh(2)
    with np.errstate(all="raise"):
        assert np.isfinite(Triangles.of(vertices, faces).nearest(np.full((1, 3), 3e38)).distance).all()
        assert np.isfinite(Triangles.of(3e38 * vertices, faces).nearest(np.zeros((1, 3))).distance).all()
