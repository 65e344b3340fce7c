"""Stages project, sort and raster of the `cpu` backend against the NumPy stages and the golden images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_runtime.camera import Camera
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.raster import PROFILES, Image
from tests.golden import rasteriser_case, rasteriser_names
from tests.measured import Measure
from tests.runtime.stages.golden_scene import camera_of, projected_of

pytest.importorskip("numba")
from tests.runtime.backends.cpu_scenes import SKY, Scene, check_image, check_screen, scene

WITHOUT_SH = ("edge_near", "edge_scale", "edge_determinant", "edge_blend")


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
    profile: str, seed: int, count: int, largest: float, size: tuple[int, int], degree: int, measured: Measure
) -> None:
    one = scene(seed, count, largest, size, degree)
    check_screen(one.screen(), one.reference(), measured)
    got, want = one.drawn(profile), one.image(profile)
    check_image(got, want, measured)
    if profile == "trainer":
        np.testing.assert_array_equal(got.last, want.last)


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


def test_stops_where_the_profile_says() -> None:
    """Behind 40 opaque splats the trainer has stopped before 1e-4; of the engine's 1e-80 at most 1e-8 is left."""
    one = stack(40, 0.01)
    for profile, stop in (("trainer", 1e-4), ("engine", 0)):
        got, want = one.drawn(profile), one.image(profile)
        np.testing.assert_allclose(got.colour, want.colour, rtol=0, atol=5e-7)
        np.testing.assert_allclose(got.transmittance, want.transmittance, rtol=0, atol=1e-7)
        assert got.transmittance.min() >= stop
    assert got.transmittance.min() <= 1e-8 < want.evaluations / got.evaluations


@pytest.mark.parametrize("profile", PROFILES)
def test_threads_change_no_bit(profile: str) -> None:
    one = scene(15, 5000, 0.1, (120, 90), 3)
    first, second = (one.drawn(profile, threads=threads) for threads in (1, 2))
    for name in ("colour", "transmittance", "last", "evaluations"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name), err_msg=name)
