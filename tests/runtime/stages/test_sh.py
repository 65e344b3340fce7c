"""Colour from spherical harmonics, and that looking along R^T d equals rotating the coefficients."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import project, sh_colour
from tests.golden import Array
from tests.measured import Measure
from tests.oracles import rotation_sh

DEGREES = (1, 2, 3)
COLOUR = 1e-6


def scene(degree: int, count: int = 200) -> tuple[Splats, Camera]:
    """Splats in front of a camera, each with a rotation of its own for its SH; colours stay above 0."""
    rng = np.random.default_rng(degree)
    mean = rng.uniform(-1, 1, (count, 3)).astype(np.float32)
    sh = rng.uniform(-0.1, 0.1, (count, (degree + 1) ** 2, 3)).astype(np.float32)
    sh[:, 0] += 2
    rotation = matrix_from_rotvec(rng.normal(size=(count, 3)) * 2).astype(np.float32)
    size, quat = np.full((count, 3), 0.05, np.float32), np.tile(np.float32([1, 0, 0, 0]), (count, 1))
    camera = Camera.orbit(np.zeros(3), 4.0, 0.3, 0.2, 0.9, 64, 64)
    return Splats(mean, size, quat, np.full(count, 0.5, np.float32), sh, rotation), camera


def rgb(splats: Splats, camera: Camera, degree: int) -> Array:
    projected = project(splats, camera, RasterSettings(), degree)
    assert (projected.radius > 0).all()
    return projected.rgb


@pytest.mark.parametrize("degree", (0, *DEGREES))
def test_colour_is_the_sum_of_the_harmonics(degree: int) -> None:
    rng = np.random.default_rng(7)
    direction = rng.normal(size=(500, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    direction = direction.astype(np.float32)
    sh = rng.uniform(-0.3, 0.3, (500, 16, 3)).astype(np.float32)  # more stored than active
    want = rotation_sh.evaluate(sh, direction, degree)
    np.testing.assert_allclose(sh_colour(sh, direction, degree), want, rtol=0, atol=COLOUR)


@pytest.mark.parametrize("degree", DEGREES)
def test_seen_along_the_turned_direction_equals_rotated_coefficients(degree: int, measured: Measure) -> None:
    splats, camera = scene(degree)
    rotated = rotation_sh.rotate(splats.sh, splats.sh_rotation, degree).astype(np.float32)
    got = rgb(splats, camera, degree)
    turned = rgb(replace(splats, sh=rotated, sh_rotation=None), camera, degree)
    measured(f"SH degree {degree} along R^T d against rotated SH", float(np.abs(got - turned).max()))
    np.testing.assert_allclose(got, turned, rtol=0, atol=COLOUR)
    unturned = rgb(replace(splats, sh_rotation=None), camera, degree)
    assert np.abs(got - unturned).max() > 0.1  # the rotation has an effect
