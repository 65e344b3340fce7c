"""Both raster profiles against literal loops, and against each other on the golden scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import Projected, project
from avatar_runtime.stages.raster import PROFILES, raster, raster_depth, tile_lists
from avatar_runtime.stages.sort import sort
from tests.golden import Array
from tests.oracles import splat

BACKGROUND = np.array([0.2, 0.5, 0.9], np.float32)
WIDTH, HEIGHT = 44, 37  # no multiples of the tile


def random_scene(seed: int, count: int, largest: float) -> tuple[Projected, Camera]:
    """Random splats about the image, some beyond its border, some behind the camera."""
    rng = np.random.default_rng(seed)
    quat = rng.normal(size=(count, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    splats = Splats(
        rng.uniform(-1.3, 1.3, (count, 3)).astype(np.float32),
        rng.uniform(0.01, largest, (count, 3)).astype(np.float32),
        quat.astype(np.float32),
        rng.uniform(0.02, 1, count).astype(np.float32),
        rng.uniform(-1, 1, (count, 1, 3)).astype(np.float32),
    )
    camera = Camera.orbit(np.zeros(3), 2.0, 0.4, 0.1, 1.0, WIDTH, HEIGHT)
    return project(splats, camera, RasterSettings(), 0), camera


def oracle_splats(p: Projected) -> list[splat.Splat]:
    return [
        splat.Splat(
            *p.centre[i].tolist(),
            float(p.depth[i]),
            *p.conic[i].tolist(),
            float(p.opacity[i]),
            tuple(p.rgb[i].tolist()),
            int(p.radius[i]),
        )
        for i in range(len(p.radius))
    ]


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize(("seed", "count", "largest"), [(1, 60, 0.1), (2, 150, 0.3), (3, 90, 1.0)])
def test_profile_meets_literal_loops(profile: str, seed: int, count: int, largest: float) -> None:
    projected, camera = random_scene(seed, count, largest)
    got = raster(projected, sort(projected), camera, BACKGROUND, profile)
    colour, left = splat.image(oracle_splats(projected), WIDTH, HEIGHT, BACKGROUND, profile)
    np.testing.assert_allclose(got.colour, colour, rtol=0, atol=2e-6)
    np.testing.assert_allclose(got.transmittance, left, rtol=0, atol=2e-6)


def stack(count: int) -> tuple[Projected, Camera]:
    """Equal opaque splats of 5 px sigma, one behind the other; 3 sigma end in the first tile."""
    one = {
        "centre": [-0.5, 8.0],
        "depth": 1.0,
        "conic": [1 / 25, 0, 1 / 25],
        "opacity": 1.0,
        "rgb": [1.0, 1.0, 1.0],
        "cov3d": [0.0] * 6,
    }
    arrays = {name: np.array([value] * count, np.float32) for name, value in one.items()}
    tiles = np.array([[0, 0, 1, 2]] * count, np.int32)
    camera = Camera.orbit(np.zeros(3), 1.0, 0.0, 0.0, 1.0, 32, 32)
    return Projected(**arrays, radius=np.full(count, 15, np.int32), tiles=tiles), camera


@pytest.mark.parametrize("profile", PROFILES)
def test_faint_opacities_warn_of_nothing(profile: str) -> None:
    """What sigmoid leaves of a logit of -100 is a denormal; nothing below 1/255 is drawn."""
    projected, camera = stack(5)
    below = np.nextafter(np.float32(1 / 255), np.float32(0))
    opacity = np.array([0, 1e-45, 3.8e-44, 1e-38, below], np.float32)
    got = raster(replace(projected, opacity=opacity), np.arange(5), camera, np.zeros(3, np.float32), profile)
    assert not got.colour.any() and (got.last == 0).all()


def test_depth_of_three_splats_by_hand() -> None:
    """exp(-d^2 / 50) >= 0.5 up to 5.9 px, 0.6 exp(-d^2 / 50) up to 3.02 px; the third lies beyond the far plane."""
    projected, camera = stack(3)
    centre = np.array([[8, 8], [14, 8], [24, 8]], np.float32)
    placed = replace(projected, centre=centre, opacity=np.array([1, 0.6, 1], np.float32))
    got = raster_depth(placed, np.array([0.7, 0.4, 1.1], np.float32), camera, 0.5)
    assert got.shape == (32, 32) and got.dtype == np.float32
    far, first, second = (np.float32(depth) for depth in (1, 0.7, 0.4))
    assert got[8].tolist() == [far] * 3 + [first] * 8 + [second] * 7 + [far] * 14
    assert got[:, 8].tolist() == [far] * 3 + [first] * 11 + [far] * 18
    most = raster_depth(placed, np.full(3, 0.5, np.float32), camera, 0.99)
    assert (most < 1).sum() == 2  # the middles of those whose opacity is 1


@st.composite
def tile_cases(draw: st.DrawFn) -> tuple[Array, Array, int, int]:
    columns, rows = draw(st.integers(1, 5)), draw(st.integers(1, 5))
    count = draw(st.integers(0, 12))
    span = lambda size: st.tuples(st.integers(0, size), st.integers(0, size)).map(sorted)  # noqa: E731
    spans = draw(st.lists(st.tuples(span(columns), span(rows)), min_size=count, max_size=count))
    rects = np.array([[x[0], y[0], x[1], y[1]] for x, y in spans], np.int32).reshape(-1, 4)
    order = draw(st.permutations(range(count)))[: draw(st.integers(0, count))]
    return rects, np.array(order, np.int64), columns, rows


@given(tile_cases())
def test_tile_lists_meet_brute_force(case: tuple[Array, Array, int, int]) -> None:
    rects, order, columns, rows = case
    eye = np.eye(4, dtype=np.float32)
    camera = Camera(eye, eye, eye[0, :3], 1.0, 1.0, 16 * columns - 3, 16 * rows)
    ids, ranges = tile_lists(rects, order, camera, 16)
    got = [ids[begin:end].tolist() for begin, end in ranges]
    assert got == splat.tile_members(rects, order, columns, rows)
