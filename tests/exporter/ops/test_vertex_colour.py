"""Mesh colours are those of the Gaussians that lie there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_export.ops.vertex_colour import FINEST, GREY, linear_from_display, vertex_colours
from avatar_runtime.avatar import Avatar
from tests.avatars import full_avatar

C0 = 0.28209479177387814


def painted(avatar: Avatar, colour: np.ndarray) -> Avatar:
    sh = np.zeros_like(avatar.gaussians.sh)
    sh[:, 0] = (colour - 0.5) / C0
    opaque = np.full(avatar.gaussians.count, 4.0, np.float32)
    return replace(avatar, gaussians=replace(avatar.gaussians, sh=sh, opacity_logit=opaque))


def test_a_head_in_two_colours_keeps_them_apart(blendshapes_avatar: Avatar) -> None:
    """Left half red, right half blue: away from the middle every vertex has its half's colour."""
    assert blendshapes_avatar.rig is not None
    left = blendshapes_avatar.gaussians.mean[:, :1] > 0
    avatar = painted(blendshapes_avatar, np.where(left, [1.0, 0.25, 0.0], [0.0, 0.25, 1.0]))
    found = vertex_colours(avatar, blendshapes_avatar.rig)
    x = blendshapes_avatar.rig.vertices[:, 0]
    np.testing.assert_allclose(found[x > 0.05], [[1.0, 0.25, 0.0]] * int((x > 0.05).sum()), atol=0.02)
    np.testing.assert_allclose(found[x < -0.05], [[0.0, 0.25, 1.0]] * int((x < -0.05).sum()), atol=0.02)


def test_each_vertex_takes_what_is_nearest_to_it(splatting_head_avatar: Avatar) -> None:
    """Colour as a smooth function of place comes back at the vertices of the canonical mesh."""
    avatar = splatting_head_avatar
    assert avatar.rig is not None and avatar.embedding is not None
    low, span = avatar.gaussians.mean.min(axis=0), np.ptp(avatar.gaussians.mean, axis=0)
    found = vertex_colours(painted(avatar, (avatar.gaussians.mean - low) / span), avatar.rig)
    want = np.clip((avatar.embedding.canonical_vertices - low) / span, 0, 1)
    assert np.abs(found - want).mean() < 0.03


def test_what_lies_a_cell_further_counts_by_how_near_it_is() -> None:
    """In the middle of its cell a vertex has the colour of that cell alone, between two cells the mean of both."""
    avatar = full_avatar()
    assert avatar.rig is not None
    cell = np.float32(1 / 64)
    diagonal = FINEST * cell / np.sqrt(np.float32(3))
    vertices = np.zeros_like(avatar.rig.vertices)
    vertices[1], vertices[2:] = diagonal, [40.5 * cell] * 3
    vertices[3, 0] += cell / 2
    mean = np.tile(vertices[2], (avatar.gaussians.count, 1))
    mean[::2, 0] += cell
    red_and_blue = np.tile([[0.0, 0, 1], [1, 0, 0]], (avatar.gaussians.count // 2, 1))
    avatar = painted(replace(avatar, gaussians=replace(avatar.gaussians, mean=mean)), red_and_blue)
    found = vertex_colours(avatar, replace(avatar.rig, vertices=vertices))
    np.testing.assert_allclose(found[2], [1, 0, 0], atol=2e-2)
    np.testing.assert_allclose(found[3], [0.5, 0, 0.5], atol=2e-2)


def test_invisible_gaussians_colour_nothing() -> None:
    avatar = full_avatar()
    assert avatar.rig is not None
    clear = replace(avatar.gaussians, opacity_logit=np.full(avatar.gaussians.count, -30.0, np.float32))
    found = vertex_colours(replace(avatar, gaussians=clear), avatar.rig)
    np.testing.assert_allclose(found, GREY, rtol=1e-6)


@pytest.mark.parametrize(
    ("display", "linear"), [(0.0, 0.0), (0.04045, 0.0031308), (0.5, 0.2140411), (1.0, 1.0)]
)
def test_the_transfer_curve_at_known_points(display: float, linear: float) -> None:
    assert linear_from_display(np.array(display)) == pytest.approx(linear, abs=1e-7)
