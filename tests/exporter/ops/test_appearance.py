"""Colours of mesh vertices, flat Gaussians on triangles, and coefficients beyond the active SH degree."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.images import frame_camera, robust_box
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.ops.surfels import FLATNESS, OPACITY_LOGIT, SPREAD, surfels
from avatar_export.ops.vertex_colour import linear_from_display, vertex_colours
from avatar_export.writers.reference_cases import every_input
from avatar_runtime.avatar import Avatar
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.player import Player
from avatar_runtime.rotation import matrix_from_quat
from tests.asm_faces import grid
from tests.avatars import full_avatar
from tests.exporter.refusals import refused

C0 = 0.28209479177387814


def painted(avatar: Avatar, colour: np.ndarray) -> Avatar:
    sh = np.zeros_like(avatar.gaussians.sh)
    sh[:, 0] = (colour - 0.5) / C0
    opaque = np.full(avatar.gaussians.count, 4.0, np.float32)
    return replace(avatar, gaussians=replace(avatar.gaussians, sh=sh, opacity_logit=opaque))


def test_a_head_in_two_colours_keeps_them_apart(blendshapes_avatar: Avatar) -> None:
    assert blendshapes_avatar.rig is not None
    left = blendshapes_avatar.gaussians.mean[:, :1] > 0
    avatar = painted(blendshapes_avatar, np.where(left, [1.0, 0.25, 0.0], [0.0, 0.25, 1.0]))
    found = vertex_colours(avatar, blendshapes_avatar.rig)
    x = blendshapes_avatar.rig.vertices[:, 0]
    np.testing.assert_allclose(found[x > 0.05], [[1.0, 0.25, 0.0]] * int((x > 0.05).sum()), atol=0.02)
    np.testing.assert_allclose(found[x < -0.05], [[0.0, 0.25, 1.0]] * int((x < -0.05).sum()), atol=0.02)


@pytest.mark.parametrize(
    ("display", "linear"), [(0.0, 0.0), (0.04045, 0.0031308), (0.5, 0.2140411), (1.0, 1.0)]
)
def test_the_transfer_curve_at_known_points(display: float, linear: float) -> None:
    assert linear_from_display(np.array(display)) == pytest.approx(linear, abs=1e-7)


Array = npt.NDArray[Any]


def covariances(gaussians: Any) -> Array:
    quat = gaussians.quat_wxyz.astype(np.float64)
    turn = matrix_from_quat(quat / np.linalg.norm(quat, axis=1, keepdims=True))
    scaled = turn * np.exp(gaussians.log_scale.astype(np.float64))[:, None]
    return np.asarray(scaled @ np.swapaxes(scaled, 1, 2))


def test_in_their_plane_they_have_the_triangle_s_second_moments() -> None:
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


def test_colours_are_the_mean_of_the_corners() -> None:
    vertices, triangles, _ = grid()
    colour = np.random.default_rng(0).uniform(0, 1, vertices.shape).astype(np.float32)
    found, _ = surfels(vertices, triangles, colour)
    shown = 0.5 + 0.28209479177387814 * found.sh[:, 0]
    np.testing.assert_allclose(shown, colour[triangles].mean(axis=1), atol=1e-6)
    assert (found.opacity_logit == np.float32(OPACITY_LOGIT)).all() and found.sh.shape[1:] == (1, 3)


def test_triangles_without_area_get_none() -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], np.float32)
    found, embedding = surfels(vertices, np.array([[0, 1, 3], [0, 1, 2], [1, 1, 2]], np.uint32), None)
    assert embedding.triangle.tolist() == [1] and found.count == 1
    refused("no triangle of the mesh has an area", surfels, vertices, np.array([[0, 1, 3]], np.uint32), None)


def test_it_plays_as_before_with_fewer_coefficients() -> None:
    stored = replace(full_avatar(2), sh_degree=1)
    assert stored.gaussians.sh.shape[1] == 16
    cut = check_avatar(with_active_sh(stored))
    assert cut.gaussians.sh.shape[1] == cut.blendshapes.appearance.values["sh"].shape[1] == 4
    assert np.array_equal(cut.gaussians.sh, stored.gaussians.sh[:, :4])
    pose = every_input(stored)
    camera = frame_camera(robust_box(stored.gaussians.mean), 48, 48)
    before, after = (Player(a, "reference").frame(pose, camera).image for a in (stored, cut))
    assert np.array_equal(before.colour, after.colour)
    assert not np.array_equal(
        before.colour, Player(full_avatar(2), "reference").frame(pose, camera).image.colour
    )
