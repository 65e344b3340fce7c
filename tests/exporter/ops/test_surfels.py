"""One flat Gaussian a triangle: its moments, its colour, and that it moves with the triangle."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.ops.surfels import CLAY, FLATNESS, OPACITY_LOGIT, SPREAD, surfels
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rotation import matrix_from_quat
from tests.asm_faces import grid

Array = npt.NDArray[Any]


def covariances(gaussians: Any) -> Array:
    quat = gaussians.quat_wxyz.astype(np.float64)
    turn = matrix_from_quat(quat / np.linalg.norm(quat, axis=1, keepdims=True))
    scaled = turn * np.exp(gaussians.log_scale.astype(np.float64))[:, None]
    return np.asarray(scaled @ np.swapaxes(scaled, 1, 2))


def test_in_their_plane_they_have_the_triangle_s_second_moments() -> None:
    """Against points spread evenly over each triangle."""
    vertices, triangles, _ = grid()
    found, embedding = surfels(vertices, triangles, None)
    assert found.count == len(triangles) and embedding.triangle.tolist() == list(range(len(triangles)))
    rng = np.random.default_rng(0)
    shares = rng.dirichlet([1, 1, 1], 40_000)
    covariance = covariances(found)
    for f in (0, 17, 130, 239):
        corners = vertices[triangles[f]].astype(np.float64)
        points = shares @ corners
        np.testing.assert_allclose(found.mean[f], corners.mean(axis=0), atol=1e-7)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal /= np.linalg.norm(normal)
        plane = np.eye(3) - np.outer(normal, normal)
        expected = SPREAD**2 * np.cov(points.T)
        largest = np.abs(expected).max()
        np.testing.assert_allclose(plane @ covariance[f] @ plane, expected, atol=0.03 * largest)
        thickness = float(normal @ covariance[f] @ normal)
        assert thickness == pytest.approx(FLATNESS**2 * np.linalg.eigvalsh(expected)[-1], rel=0.03)


def test_a_sliver_keeps_a_width() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0.5, 1e-5, 0]], np.float32)
    found, _ = surfels(vertices, np.array([[0, 1, 2]], np.uint32), None)
    length, thick, width = np.exp(found.log_scale[0])
    assert thick == pytest.approx(FLATNESS * length, rel=1e-5) and width == pytest.approx(thick, rel=1e-5)


def test_colours_are_the_mean_of_the_corners() -> None:
    vertices, triangles, _ = grid()
    colour = np.random.default_rng(0).uniform(0, 1, vertices.shape).astype(np.float32)
    found, _ = surfels(vertices, triangles, colour)
    shown = 0.5 + 0.28209479177387814 * found.sh[:, 0]
    np.testing.assert_allclose(shown, colour[triangles].mean(axis=1), atol=1e-6)
    assert (found.opacity_logit == np.float32(OPACITY_LOGIT)).all() and found.sh.shape[1:] == (1, 3)


def test_clay_is_lit_from_above() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1]], np.float32)
    found, _ = surfels(vertices, np.array([[0, 1, 2], [0, 1, 3], [2, 1, 0]], np.uint32), None)
    front, below, back = 0.5 + 0.28209479177387814 * found.sh[:, 0]
    assert (front < CLAY).all() and (front > 0.8 * np.array(CLAY)).all()
    assert (below < front).all() and (back <= below).all() and (back > 0.3 * np.array(CLAY)).all()


def test_triangles_without_area_get_none() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], np.float32)
    found, embedding = surfels(vertices, np.array([[0, 1, 3], [0, 1, 2], [1, 1, 2]], np.uint32), None)
    assert embedding.triangle.tolist() == [1] and found.count == 1
    with pytest.raises(AvatarError, match="no triangle of the mesh has an area"):
        surfels(vertices, np.array([[0, 1, 3]], np.uint32), None)
