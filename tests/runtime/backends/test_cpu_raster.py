"""Stages project, sort and raster of the `cpu` backend against the NumPy stages and the golden images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_runtime.camera import Camera
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import Projected
from avatar_runtime.stages.raster import PROFILES, Image, raster
from avatar_runtime.stages.sort import sort
from tests.golden import rasteriser_case, rasteriser_names
from tests.measured import Measure
from tests.runtime.stages.golden_scene import camera_of, projected_of

pytest.importorskip("numba")
from avatar_runtime.backends.cpu.draw.frame import composite, screen_of
from tests.runtime.backends.cpu_scenes import SKY, Scene, check_image, check_screen, scene

WITHOUT_SH = ("edge_near", "edge_scale", "edge_determinant", "edge_blend")


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("name", rasteriser_names())
def test_raster_meets_the_reference_on_golden_scenes(name: str, profile: str, measured: Measure) -> None:
    case = rasteriser_case(name).arrays
    camera, p = camera_of(case), projected_of(case)
    order = sort(p)
    want = raster(p, order, camera, case["bg"], profile)
    screen, ids = screen_of(p, order, camera, profile)
    got = composite(screen, ids, camera, case["bg"], profile, 1)
    check_image(got, want, measured)
    if profile == "trainer":
        np.testing.assert_array_equal(got.last, want.last)


@pytest.mark.parametrize("name", [name for name in rasteriser_names() if name not in WITHOUT_SH])
def test_meets_the_golden_numbers(name: str, measured: Measure) -> None:
    """The whole chain against what the released rasteriser computed."""
    case = rasteriser_case(name).arrays
    splats = Splats(
        *(case["means3D"], case["scales"] * case["scale_modifier"], case["rotations"], case["opacities"]),
        case["shs"],
    )
    golden = Scene(splats, camera_of(case), int(case["sh_degree"]))
    check_screen(golden.screen(), projected_of(case), measured)
    got = golden.drawn("trainer", case["bg"])
    want = Image(case["out_color"].transpose(1, 2, 0), case["final_T"])
    check_image(got, want, measured)
    if "n_contrib" in case:
        np.testing.assert_array_equal(got.last, case["n_contrib"].astype(np.int32))


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize(
    ("seed", "count", "largest", "size", "degree"),
    [
        (1, 300, 0.2, (44, 37), 0),
        (2, 900, 0.1, (64, 48), 1),  # whole tiles
        (3, 333, 0.3, (33, 17), 2),
        (4, 4000, 0.05, (97, 80), 3),
        (5, 200, 3.0, (40, 40), 3),  # each covers the image
        (6, 50, 0.5, (1, 1), 3),
        (7, 50, 0.5, (1, 130), 0),
        (8, 1, 0.3, (130, 1), 0),
    ],
)
def test_random_scenes_meet_the_reference(
    profile: str,
    seed: int,
    count: int,
    largest: float,
    size: tuple[int, int],
    degree: int,
    measured: Measure,
) -> None:
    one = scene(seed, count, largest, size, degree)
    check_screen(one.screen(), one.reference(), measured)
    got, want = one.drawn(profile), one.image(profile)
    check_image(got, want, measured)
    if profile == "trainer":
        np.testing.assert_array_equal(got.last, want.last)


@pytest.mark.parametrize("profile", PROFILES)
def test_needles_meet_the_reference(profile: str, measured: Measure) -> None:
    """So thin that the determinant cancels: conics that are wrong, indefinite, or no ellipse in float32."""
    one = scene(11, 600, 1.0)
    scale = one.splats.scale.copy()
    scale[:, 0] = np.geomspace(1e-2, 1e4, len(scale))
    scale[:, 1:] *= np.float32(1e-4)
    one = replace(one, splats=replace(one.splats, scale=scale))
    conic = one.reference().conic.astype(np.float64)
    form = conic[:, 0] * conic[:, 2] - conic[:, 1] ** 2
    assert (form < 0).any() and (np.abs(form) < 1e-6 * conic[:, 0] * conic[:, 2]).any()
    check_screen(one.screen(), one.reference(), measured)
    check_image(one.drawn(profile), one.image(profile), measured)


@pytest.mark.parametrize("profile", PROFILES)
def test_what_is_no_ellipse_meets_the_reference(profile: str, measured: Measure) -> None:
    """Indefinite and degenerate conics fade along one direction at most; positive exponents are skipped."""
    conic = np.float32(
        [
            [0.02, 0.05, 0.02],
            [-0.02, 0.01, 0.05],
            [0.03, 0, 0],
            [0, 0, 0.2],
            [-0.1, 0, -0.1],
            [0.04, 0.04, 0.04],
        ]
    )
    n = len(conic)
    p = Projected(
        centre=np.float32([[20.3, 17.1]] * n),
        depth=np.ones(n, np.float32),
        conic=conic,
        opacity=np.linspace(0.2, 0.9, n).astype(np.float32),
        rgb=np.random.default_rng(5).uniform(0, 1, (n, 3)).astype(np.float32),
        radius=np.full(n, 12, np.int32),
        cov3d=np.zeros((n, 6), np.float32),
        tiles=np.tile(np.int32([0, 0, 2, 2]), (n, 1)),
    )
    camera = scene(1, size=(60, 70)).camera
    want = raster(p, np.arange(n), camera, SKY, profile)
    assert (want.transmittance < 1).mean() > 0.1
    screen, ids = screen_of(p, np.arange(n), camera, profile)
    check_image(composite(screen, ids, camera, SKY, profile, 1), want, measured)


@pytest.mark.parametrize("profile", PROFILES)
def test_full_hd_meets_the_reference(profile: str, measured: Measure) -> None:
    one = scene(12, 60, 0.05, (1920, 1080))
    check_image(one.drawn(profile), one.image(profile), measured)


ABSURD = dict.fromkeys(
    ("mean", "scale", "quat_wxyz"), (np.nan, np.inf, -np.inf, 0.0, 1e8, 1e15, 1e30, -1e30, 1e-40)
) | {"opacity": (np.nan, -1.0, 0.0, 1e-40, 1 / 255, 30.0)}


@pytest.mark.parametrize("profile", PROFILES)
def test_absurd_numbers_are_culled_as_the_reference_culls_them(profile: str, measured: Measure) -> None:
    one = scene(13, 300)
    arrays, row = {name: getattr(one.splats, name).copy() for name in ABSURD}, 0
    for name, values in ABSURD.items():
        for value in values:
            for column in range(arrays[name][0].size):
                arrays[name].reshape(300, -1)[row, column] = value
                row += 1
    one = replace(one, splats=replace(one.splats, **arrays))
    with np.errstate(all="ignore"):
        check_screen(one.screen(), one.reference(), measured)
        want = one.image(profile)
    assert 0 < (one.reference().radius[:row] == 0).sum() < row
    check_image(one.drawn(profile), want, measured)


@pytest.mark.parametrize("profile", PROFILES)
def test_nothing_drawn_is_the_background(profile: str) -> None:
    behind = scene(14)
    mean = behind.splats.mean + 10 * (behind.camera.centre / np.linalg.norm(behind.camera.centre))
    behind = replace(behind, splats=replace(behind.splats, mean=mean.astype(np.float32)))
    faint = replace(behind, splats=replace(scene(14).splats, opacity=np.full(300, 1 / 256, np.float32)))
    for one in (scene(1, 0), behind, faint):
        got = one.drawn(profile)
        np.testing.assert_array_equal(got.colour, np.broadcast_to(SKY, (37, 44, 3)))
        assert (got.transmittance == 1).all() and (got.last == 0).all() and got.evaluations == 0


def stack(count: int, depth: float, opacity: float = 1.0, scale: float = 0.1) -> Scene:
    """Equal splats of different colours, one behind the other where `depth` is not 0."""
    rng = np.random.default_rng(3)
    mean = np.zeros((count, 3), np.float32)
    mean[:, 2] = depth * np.arange(count)[::-1]
    splats = Splats(
        mean,
        np.full((count, 3), scale, np.float32),
        np.tile(np.float32([1, 0, 0, 0]), (count, 1)),
        np.full(count, opacity, np.float32),
        rng.uniform(-1, 1, (count, 1, 3)).astype(np.float32),
    )
    return Scene(splats, Camera.orbit(np.zeros(3), 3.0, 0.0, 0.0, 1.0, 40, 40), 0)


@pytest.mark.parametrize("profile", PROFILES)
def test_equal_depths_are_composited_by_id(profile: str, measured: Measure) -> None:
    one = stack(50, 0.0, 0.3)
    assert len(set(one.reference().depth)) == 1
    check_image(one.drawn(profile), one.image(profile), measured)


def test_stops_where_the_profile_says() -> None:
    """Behind 40 opaque splats the trainer has stopped before 1e-4; of the engine's 1e-80 at most 1e-8 is left."""
    one = stack(40, 0.01)
    for profile, stop in (("trainer", 1e-4), ("engine", 0)):
        got, want = one.drawn(profile), one.image(profile)
        np.testing.assert_allclose(got.colour, want.colour, rtol=0, atol=5e-7)
        np.testing.assert_allclose(got.transmittance, want.transmittance, rtol=0, atol=1e-7)
        assert got.transmittance.min() >= stop
    assert got.transmittance.min() <= 1e-8 < want.evaluations / got.evaluations


def test_counts_the_exponents_that_it_computes() -> None:
    """A splat less wide than a block of 4x4 pixels in the middle of one: 16; the reference takes its tiles."""
    one = stack(1, 0.0)
    camera = Camera.orbit(np.zeros(3), 3.0, 0.0, 0.0, 1.0, 38, 38)  # the centre at 18.5, 18.5
    small = replace(one.splats, scale=np.full((1, 3), 1e-6, np.float32), opacity=np.full(1, 0.05, np.float32))
    one = replace(one, splats=small, camera=camera)
    for profile in PROFILES:
        assert one.drawn(profile).evaluations == 16 < one.image(profile).evaluations


@pytest.mark.parametrize("profile", PROFILES)
def test_closed_blocks_cost_nothing(profile: str) -> None:
    """The middle of a stack of opaque splats is closed long before its rim."""
    first, all_ = (stack(n, 0.0, scale=0.4).drawn(profile).evaluations for n in (1, 320))
    assert 0.1 < all_ / (320 * first) < 0.9


@pytest.mark.parametrize("profile", PROFILES)
def test_threads_change_no_bit(profile: str) -> None:
    one = scene(15, 5000, 0.1, (120, 90), 3)
    first, second = (one.drawn(profile, threads=threads) for threads in (1, 2))
    for name in ("colour", "transmittance", "last", "evaluations"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name), err_msg=name)
