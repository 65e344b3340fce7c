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
from avatar_runtime.stages.raster import PROFILES, raster, tile_lists
from avatar_runtime.stages.sort import sort
from tests.golden import Array, rasteriser_case
from tests.oracles import splat
from tests.runtime.stages.golden_scene import camera_of, projected_of

BACKGROUND = np.array([0.2, 0.5, 0.9], np.float32)
# Five scenes of ordinary Gaussians; the edge cases are made to distinguish the profiles.
ALIKE = ("random_sh0", "random_sh3", "dense", "principal_point", "playbot_a")
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


def test_the_scenes_tell_the_profiles_apart() -> None:
    """By far more than the tolerance above, so that no profile can pass as the other."""
    projected, camera = random_scene(2, 150, 0.3)
    trainer, engine = (
        raster(projected, sort(projected), camera, BACKGROUND, profile) for profile in PROFILES
    )
    assert np.abs(trainer.colour - engine.colour).max() > 5e-4


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


def test_engine_draws_beyond_the_radius() -> None:
    """16.5 px away is 3.3 sigma: e^-5.4 = 0.0043 > 1/255, but the trainer's square has ended."""
    projected, camera = stack(1)
    black, order = np.zeros(3, np.float32), np.arange(1)
    assert raster(projected, order, camera, black, "trainer").colour[8, 16].max() == 0
    assert raster(projected, order, camera, black, "engine").colour[8, 16].min() > 1 / 255


def test_engine_does_not_stop() -> None:
    """At alpha 0.99 the trainer adds one splat (a second would leave T below 1e-4), the engine all ten."""
    projected, camera = stack(10)
    black, order = np.zeros(3, np.float32), np.arange(10)
    trainer, engine = (raster(projected, order, camera, black, profile) for profile in PROFILES)
    assert (trainer.last[8, 0], engine.last[8, 0]) == (1, 10)
    np.testing.assert_allclose(trainer.transmittance[8, 0], 0.01, rtol=1e-5)
    np.testing.assert_allclose(engine.transmittance[8, 0], 1e-20, rtol=1e-4)


@pytest.mark.parametrize("profile", PROFILES)
def test_faint_opacities_warn_of_nothing(profile: str) -> None:
    """What sigmoid leaves of a logit of -100 is a denormal; nothing below 1/255 is drawn."""
    projected, camera = stack(5)
    below = np.nextafter(np.float32(1 / 255), np.float32(0))
    opacity = np.array([0, 1e-45, 3.8e-44, 1e-38, below], np.float32)
    got = raster(replace(projected, opacity=opacity), np.arange(5), camera, np.zeros(3, np.float32), profile)
    assert not got.colour.any() and (got.last == 0).all()


@pytest.mark.parametrize("name", ALIKE)
def test_profiles_agree_inside_the_mask(name: str) -> None:
    case = rasteriser_case(name).arrays
    projected, camera = projected_of(case), camera_of(case)
    order = sort(projected)
    trainer, engine = (raster(projected, order, camera, case["bg"], profile) for profile in PROFILES)
    inside = trainer.transmittance < 0.5
    error = (trainer.colour - engine.colour)[inside].astype(np.float64)
    psnr = -10 * np.log10(np.mean(error**2))
    assert inside.mean() > 0.05
    assert psnr >= 65, f"{psnr:.1f} dB inside {inside.mean():.0%} of the image"


def test_unknown_profile_is_the_callers_mistake() -> None:
    projected, camera = random_scene(1, 3, 0.1)
    with pytest.raises(ValueError, match="trainer, engine"):
        raster(projected, sort(projected), camera, BACKGROUND, "fast")


def test_an_empty_scene_is_the_background() -> None:
    projected, camera = random_scene(1, 3, 0.1)
    for profile in PROFILES:
        got = raster(projected, np.zeros(0, np.int64), camera, BACKGROUND, profile)
        np.testing.assert_array_equal(got.colour, np.broadcast_to(BACKGROUND, (HEIGHT, WIDTH, 3)))
        assert (got.transmittance == 1).all() and (got.last == 0).all() and got.evaluations == 0


def test_evaluations_count_every_pair_of_the_engine_profile() -> None:
    """One splat that touches one whole tile: 256 exponents."""
    projected, camera = random_scene(1, 1, 0.1)
    projected = replace(projected, tiles=np.array([[0, 0, 1, 1]], np.int32))
    assert raster(projected, np.zeros(1, np.int64), camera, BACKGROUND).evaluations == 256


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


def test_sort_is_front_to_back_with_ties_by_id() -> None:
    projected, _ = random_scene(1, 40, 0.1)
    depth = np.round(projected.depth * 4) / 4
    got = sort(replace(projected, depth=depth.astype(np.float32)))
    assert got.tolist() == sorted(np.flatnonzero(projected.radius).tolist(), key=lambda i: (depth[i], i))
