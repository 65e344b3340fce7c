"""Where a camera puts what it sees, and orbits by direction."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import project
from tests.golden import Array

WIDTH, HEIGHT = 80, 60
MIDDLE = ((WIDTH - 1) / 2, (HEIGHT - 1) / 2)
FOV_Y = 0.8
TARGET = np.array([0.1, 1.5, -0.2])
X, Y, Z = np.eye(3)


def seen(camera: Camera, point: Array) -> tuple[float, float, float]:
    """(column, row, depth) at which stage `project` draws a small splat at `point`."""
    splats = Splats(
        np.asarray(point, np.float32)[None],
        np.full((1, 3), 0.01, np.float32),
        np.array([[1, 0, 0, 0]], np.float32),
        np.ones(1, np.float32),
        np.zeros((1, 1, 3), np.float32),
    )
    projected = project(splats, camera, RasterSettings(), 0)
    assert projected.radius[0] > 0
    return (*projected.centre[0].tolist(), float(projected.depth[0]))


@pytest.mark.parametrize(
    ("yaw", "pitch", "eye", "right", "up"),
    [
        (0, 0, Z, X, Y),  # in front: the subject's left (+X) is on the image's right
        (np.pi / 2, 0, X, -Z, Y),  # from the subject's left: the nose (+Z) points to the image's left
        (-np.pi / 2, 0, -X, Z, Y),
        (np.pi, 0, -Z, -X, Y),
        (0, np.pi / 2, Y, X, -Z),  # from above: the nose points down
        (0, -np.pi / 2, -Y, X, Z),
    ],
)
def test_orbit_directions(yaw: float, pitch: float, eye: Array, right: Array, up: Array) -> None:
    camera = Camera.orbit(TARGET, 2.0, yaw, pitch, FOV_Y, WIDTH, HEIGHT)
    np.testing.assert_allclose(camera.centre, TARGET + 2 * eye, atol=1e-6)
    np.testing.assert_allclose(seen(camera, TARGET), (*MIDDLE, 2.0), atol=1e-4)
    column, row, depth = seen(camera, TARGET + 0.1 * right)
    assert column > MIDDLE[0] + 3
    np.testing.assert_allclose((row, depth), (MIDDLE[1], 2.0), atol=1e-4)
    column, row, depth = seen(camera, TARGET + 0.1 * up)
    assert row < MIDDLE[1] - 3
    np.testing.assert_allclose((column, depth), (MIDDLE[0], 2.0), atol=1e-4)


def test_opencv_pixels_are_k_times_the_point() -> None:
    """K puts pixel centres at half integers, the rasteriser at integers."""
    k = np.array([[90.0, 0, 33.25], [0, 100, 41.5], [0, 0, 1]])
    rotation, translation = np.diag([1.0, -1, -1]), np.array([0.1, 0.2, 3.0])
    camera = Camera.from_opencv(rotation, translation, k, WIDTH, HEIGHT)
    point = np.array([0.3, -0.4, 0.5])
    x, y, z = rotation @ point + translation
    np.testing.assert_allclose(
        seen(camera, point), (90 * x / z + 33.25 - 0.5, 100 * y / z + 41.5 - 0.5, z), rtol=1e-5
    )
    np.testing.assert_allclose(camera.centre, -rotation.T @ translation, atol=1e-6)


def projected(k: Array, towards: int) -> Array:
    """The projection of an engine, y up, whose camera looks along -z or +z, that sees what `k` sees."""
    x, y = 2 * k[0] / WIDTH - [0, 0, 1], 2 * k[1] / HEIGHT - [0, 0, 1]
    rows = [[*x, 0], [*-y, 0], [0, 0, 1.2, -0.3], [0, 0, 1, 0]]
    result: Array = 0.7 * np.array(rows) @ np.diag([1, -1, towards, 1])
    return result


@pytest.mark.parametrize("towards", [-1, 1])
def test_a_camera_of_opengl_sees_what_that_of_opencv_sees(towards: int) -> None:
    """Cameras of engines that look along +z, and projections of any depth range and size, mean the same."""
    k = np.array([[90.0, 2, 33.25], [0, 100, 41.5], [0, 0, 1]])
    rotation, translation = matrix_from_rotvec(np.array([0.3, 2.0, -0.5])), np.array([0.1, 0.2, 3.0])
    want = Camera.from_opencv(rotation, translation, k, WIDTH, HEIGHT)
    view = np.diag([1, -1, towards, 1]) @ homogeneous(rotation, translation)
    got = Camera.from_opengl(view, projected(k, towards), WIDTH, HEIGHT)
    for name, value in vars(want).items():
        np.testing.assert_allclose(getattr(got, name), value, rtol=2e-6, atol=2e-6, err_msg=name)


@pytest.mark.parametrize(("width", "height"), [(0, 60), (80, 0), (-1, 5), (10**9, 1), (1, 32769)])
def test_an_image_needs_pixels_and_not_too_many(width: int, height: int) -> None:
    for make in (
        lambda: Camera.from_opencv(np.eye(3), np.zeros(3), np.eye(3), width, height),
        lambda: Camera.orbit(np.zeros(3), 1.0, 0.0, 0.0, 0.5, width, height),
    ):
        with pytest.raises(ValueError, match=r"^(width|height) is -?[0-9]+; 1 to 32768 is needed$"):
            make()
