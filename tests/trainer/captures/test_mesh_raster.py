"""The mesh rasteriser against ray tracing in world space and against areas that are known."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.camera import Camera
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.captures.mesh_raster import Surface, draw
from tests.measured import Measure

Array = npt.NDArray[Any]

SIZE = 24
FRONT = np.diag([1.0, -1.0, -1.0])  # the camera's rotation before a world that looks along +Z
SLOPE = np.array([[0.3, 0.1], [-0.2, 0.25], [0.15, -0.35]])  # of the test texture's channels, in u and v


@pytest.fixture(autouse=True)
def all_threads() -> Iterator[None]:
    """Leaves the number of threads as it was."""
    before = numba.get_num_threads()
    yield
    numba.set_num_threads(before)


def ramp(size: int = 64) -> Array:
    """A texture that is linear in u and v, so that any way to interpolate it gives the same."""
    u, v = np.meshgrid((np.arange(size) + 0.5) / size, (np.arange(size) + 0.5) / size)
    return (0.5 + np.stack([u, v], axis=-1) @ SLOPE.T).astype(np.float32)


def surface(vertices: Array, triangles: Array, uv: Array | None = None, opacity: float = 1.0) -> Surface:
    """A mesh of one opacity with the ramp on it, uv in the middle of the texture unless given."""
    vertices, triangles = np.asarray(vertices, np.float64), np.asarray(triangles, np.int64)
    ones = np.ones(len(vertices), np.float32)
    if uv is None:
        uv = np.full((len(triangles), 3, 2), 0.5)
    return Surface(vertices, triangles, uv.astype(np.float32), ramp(), ones, 0 * ones, opacity * ones)


def square(x0: float, x1: float, y0: float, y1: float, depth: float, opacity: float = 1.0) -> Surface:
    """A rectangle that covers these pixels (K's numbers) of `plain_camera`, facing it."""
    x, y = (np.array(ends) - SIZE / 2 for ends in ((x0, x1), (y0, y1)))
    corner = [
        (a / 20 * depth, -b / 20 * depth, -depth)
        for a, b in ((x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1]))
    ]
    return surface(corner, [(0, 1, 2), (0, 2, 3)], opacity=opacity)


def plain_camera() -> Camera:
    """At the origin, looking along -Z, focal length 20 pixels."""
    k = np.array([[20.0, 0, SIZE / 2], [0, 20.0, SIZE / 2], [0, 0, 1]])
    return Camera.from_opencv(FRONT, np.zeros(3), k, SIZE, SIZE)


def traced(
    mesh: Surface, origin: Array, direction: Array, near: float, forward: Array
) -> tuple[Array, Array]:
    """(colour [3], hit) along a ray by solving origin + t d = a + v (b - a) + w (c - a) for every triangle."""
    best, colour = np.inf, np.zeros(3)
    for f, (a, b, c) in enumerate(mesh.vertices[mesh.triangles]):
        system = np.stack([-direction, b - a, c - a], axis=1)
        if abs(np.linalg.det(system)) < 1e-12:
            continue
        t, v, w = np.linalg.solve(system, origin - a)
        if v < 0 or w < 0 or v + w > 1 or not near <= t * (direction @ forward) < best:
            continue
        best = t * (direction @ forward)
        corner, bary = mesh.triangles[f], np.array([1 - v - w, v, w])
        base = 0.5 + SLOPE @ (bary @ mesh.uv[f])
        colour = np.clip(base * (bary @ mesh.gain[corner]) + bary @ mesh.gloss[corner], 0, 1)
    return colour, np.array(np.isfinite(best))


def soup(rng: np.random.Generator, count: int) -> Surface:
    """Triangles at random in front of the camera, a few through it, and lit at random."""
    vertices = rng.uniform((-1.2, -1.2, -3), (1.2, 1.2, 0.3), (3 * count, 3))
    vertices[::12, 2] = 0.8  # every fourth triangle
    mesh = surface(vertices, np.arange(3 * count).reshape(-1, 3), rng.uniform(0.1, 0.9, (count, 3, 2)))
    light = rng.uniform(0.5, 1.2, 3 * count), rng.uniform(0, 0.1, 3 * count)
    return replace(mesh, gain=light[0].astype(np.float32), gloss=light[1].astype(np.float32))


@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_rays_in_world_space(seed: int, measured: Measure) -> None:
    rng = np.random.default_rng(seed)
    rotation = matrix_from_rotvec(rng.normal(0, 0.2, 3)) @ FRONT
    translation, near = rng.normal(0, 0.1, 3), 0.2
    k = np.array([[21.0, 0, 11.3], [0, 19.0, 12.9], [0, 0, 1]])
    mesh = soup(rng, 8)
    assert (mesh.vertices @ rotation.T + translation)[:, 2].min() < 0, (
        "some triangles reach behind the camera"
    )
    image = draw(mesh, Camera.from_opencv(rotation, translation, k, SIZE, SIZE - 3), 1, near)
    origin, worst, hits = -rotation.T @ translation, 0.0, 0
    for y in range(SIZE - 3):
        for x in range(SIZE):
            ray = rotation.T @ np.array([(x + 0.5 - 11.3) / 21, (y + 0.5 - 12.9) / 19, 1])
            colour, hit = traced(mesh, origin, ray, near, rotation[2])
            assert image.alpha[y, x] == hit, (x, y)
            worst = max(worst, float(np.abs(image.colour[y, x] - colour).max()))
            hits += int(hit)
    assert 100 < hits < SIZE * (SIZE - 3), "the image shows both mesh and background"
    measured("mesh raster against traced rays, colour", worst, 2e-5)
    assert worst < 2e-5


@pytest.mark.parametrize(("bump", "samples"), [(0.0, 1), (0.0, 2), (0.0, 5), (0.05, 2), (0.05, 4)])
def test_no_cracks_between_triangles(bump: float, samples: int) -> None:
    k = np.array([[16.0, 0, 16], [0, 16.0, 16], [0, 0, 1]])
    camera = Camera.from_opencv(FRONT, np.zeros(3), k, 32, 32)
    place = (np.arange(34) - 0.5 - 16) / 16
    x, y = (a.ravel() for a in np.meshgrid(place, place))
    z = -1 + bump * np.sin(9 * x) * np.cos(7 * y)
    cell = (np.arange(33)[:, None] * 34 + np.arange(33)).ravel()
    triangles = np.stack([cell, cell + 1, cell + 35, cell, cell + 35, cell + 34], axis=1).reshape(-1, 3)
    for side in (triangles, triangles[:, ::-1]):
        wall = surface(np.stack([-x * z, -y * z, z], axis=1), side)
        assert (draw(wall, camera, samples).alpha == 1).all()


def test_nothing_nearer_than_near_and_a_floor_reaches_behind_the_camera() -> None:
    floor = surface([(-50, -1, 5), (50, -1, 5), (50, -1, -1e4), (-50, -1, -1e4)], [(0, 1, 2), (0, 2, 3)])
    rows = draw(floor, plain_camera(), 1).alpha.sum(axis=1)
    assert (rows[: SIZE // 2] == 0).all() and (rows[SIZE // 2 :] > 0).all()
    assert (rows[SIZE // 2 + 1 :] == SIZE).all()
    # Row y sees the floor at depth 20 / (y + 0.5 - 12): the last one nearer than 2 metres.
    cut = draw(floor, plain_camera(), 1, near=2.0).alpha.sum(axis=1)
    assert cut[21] == SIZE and cut[22] == 0


def test_wrong_arguments_are_named() -> None:
    mesh, skewed = square(4, 20, 4, 20, 1.0), np.array([[20.0, 3, 12], [0, 20, 12], [0, 0, 1]])
    with pytest.raises(ValueError, match="samples 0"):
        draw(mesh, plain_camera(), 0)
    with pytest.raises(ValueError, match="near 0"):
        draw(mesh, plain_camera(), 1, 0.0)
    with pytest.raises(ValueError, match="skew"):
        draw(mesh, Camera.from_opencv(FRONT, np.zeros(3), skewed, SIZE, SIZE))
    with pytest.raises(ValueError, match=r"gain is \(3,\), expected \(4,\)"):
        draw(replace(mesh, gain=mesh.gain[:3]), plain_camera())
    with pytest.raises(ValueError, match="beyond the 4"):
        draw(replace(mesh, triangles=mesh.triangles + 1), plain_camera())
