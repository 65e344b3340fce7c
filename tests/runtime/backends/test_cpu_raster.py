"""Stages project, sort and raster of the `cpu` backend against the NumPy stages and the golden pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_runtime.posed import Clock
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import Projected, project
from avatar_runtime.stages.raster import PROFILES, Picture, raster
from avatar_runtime.stages.raster import tile_lists as reference_lists
from avatar_runtime.stages.sort import sort
from tests.avatars import full_avatar
from tests.golden import Array, rasteriser_case, rasteriser_names
from tests.measured import Measure
from tests.runtime.stages.golden_scene import camera_of, projected_of

pytest.importorskip("numba")
from avatar_runtime.backends.cpu.draw import tiles as cpu_tiles
from avatar_runtime.backends.cpu.draw.frame import STAGES, blend, draw, screen_of
from avatar_runtime.backends.cpu.draw.project import project as cpu_project
from avatar_runtime.backends.cpu.draw.screen import CENTRE_X, CONIC_XX, OPACITY, RED, Screen
from avatar_runtime.backends.cpu.draw.sort import sort as cpu_sort

TOLERANCE = 1e-4  # what is further away is a threshold's other side: alpha at 1/255 or T at 1e-4
FLIP = 4e-3
FLIPPED_SHARE = 1e-4  # of the pixels, and one more
COLOUR_TOLERANCE = 1e-6  # SH sums are fused here
WITHOUT_SH = ("edge_near", "edge_scale", "edge_determinant", "edge_blend")
BLACK = np.zeros(3, np.float32)
SKY = np.array([0.2, 0.5, 0.9], np.float32)


@dataclass(frozen=True)
class Scene:
    splats: Splats
    camera: Camera
    degree: int

    def reference(self) -> Projected:
        with np.errstate(invalid="ignore"):
            return project(self.splats, self.camera, RasterSettings(), self.degree)

    def picture(self, profile: str, background: Array = SKY) -> Picture:
        projected = self.reference()
        return raster(projected, sort(projected), self.camera, background, profile)

    def screen(self, profile: str = "trainer", workers: int = 1) -> Screen:
        return cpu_project(self.splats, self.camera, RasterSettings(), self.degree, profile, workers)

    def drawn(self, profile: str, background: Array = SKY, threads: int = 1) -> Picture:
        s = self.splats
        return draw(
            *(s.mean, s.scale, s.quat_wxyz, s.opacity, s.sh, s.sh_rotation, self.camera),
            *(RasterSettings(), self.degree, background, profile, threads, Clock()),
        )


def scene(
    seed: int, count: int = 300, largest: float = 0.2, size: tuple[int, int] = (44, 37), degree: int = 0
) -> Scene:
    """Random splats about the picture, some beyond its border, some behind the camera."""
    rng = np.random.default_rng(seed)
    quat = rng.normal(size=(count, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    splats = Splats(
        rng.uniform(-1.3, 1.3, (count, 3)).astype(np.float32),
        (largest * rng.uniform(0.02, 1, (count, 3)) ** 2).astype(np.float32),
        quat.astype(np.float32),
        rng.uniform(0.001, 1, count).astype(np.float32),
        rng.normal(size=(count, (degree + 1) ** 2, 3)).astype(np.float32),
        np.linalg.qr(rng.normal(size=(count, 3, 3)))[0].astype(np.float32) if degree else None,
    )
    camera = Camera.orbit(np.zeros(3), 2.0, 0.4, 0.1, 1.0, *size)
    return Scene(splats, camera, degree)


def check_picture(got: Picture, want: Picture, measured: Measure) -> None:
    """Equal to TOLERANCE but for flips, few and small."""
    error = np.abs(got.colour.astype(np.float64) - want.colour).max(axis=-1)
    left = np.abs(got.transmittance.astype(np.float64) - want.transmittance)
    flipped = np.maximum(error, left) > TOLERANCE
    measured("cpu picture against reference, pixels on a threshold's other side, count", float(flipped.sum()))
    measured("cpu picture against reference, those pixels' difference", float(error[flipped].max(initial=0)))
    measured("cpu picture against reference, difference", float(error[~flipped].max(initial=0)))
    assert max(error.max(), left.max()) <= FLIP
    assert flipped.sum() <= 1 + FLIPPED_SHARE * error.size


def check_screen(got: Screen, want: Projected, measured: Measure) -> None:
    """The same bits but for the colour."""
    pairs = {
        "centre": (got.splats[:, CENTRE_X : CENTRE_X + 2], want.centre),
        "conic": (got.splats[:, CONIC_XX : CONIC_XX + 3], want.conic),
        "opacity": (got.splats[:, OPACITY], want.opacity),
        "depth": (got.depth, want.depth),
        "radius": (got.radius, want.radius),
        "tiles": (got.tiles, want.tiles),
    }
    for name, (a, b) in pairs.items():
        np.testing.assert_array_equal(a, b, err_msg=name)
    rgb = got.splats[:, RED : RED + 3]
    measured("cpu SH colour against reference, difference", float(np.abs(rgb - want.rgb).max(initial=0)))
    np.testing.assert_allclose(rgb, want.rgb, rtol=0, atol=COLOUR_TOLERANCE)


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("name", rasteriser_names())
def test_raster_meets_the_reference_on_golden_scenes(name: str, profile: str, measured: Measure) -> None:
    case = rasteriser_case(name).arrays
    camera, p = camera_of(case), projected_of(case)
    order = sort(p)
    want = raster(p, order, camera, case["bg"], profile)
    screen, ids = screen_of(p, order, camera, profile)
    got = blend(screen, ids, camera, case["bg"], profile, 1)
    check_picture(got, want, measured)
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
    want = Picture(case["out_color"].transpose(1, 2, 0), case["final_T"])
    check_picture(got, want, measured)
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
        (5, 200, 3.0, (40, 40), 3),  # each covers the picture
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
    got, want = one.drawn(profile), one.picture(profile)
    check_picture(got, want, measured)
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
    check_picture(one.drawn(profile), one.picture(profile), measured)


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
    check_picture(blend(screen, ids, camera, SKY, profile, 1), want, measured)


@pytest.mark.parametrize("profile", PROFILES)
def test_full_hd_meets_the_reference(profile: str, measured: Measure) -> None:
    one = scene(12, 60, 0.05, (1920, 1080))
    check_picture(one.drawn(profile), one.picture(profile), measured)


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
        want = one.picture(profile)
    assert 0 < (one.reference().radius[:row] == 0).sum() < row
    check_picture(one.drawn(profile), want, measured)


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
def test_equal_depths_are_blended_by_id(profile: str, measured: Measure) -> None:
    one = stack(50, 0.0, 0.3)
    assert len(set(one.reference().depth)) == 1
    check_picture(one.drawn(profile), one.picture(profile), measured)


def test_stops_where_the_profile_says() -> None:
    """Behind 40 opaque splats the trainer has stopped before 1e-4; of the engine's 1e-80 at most 1e-8 is left."""
    one = stack(40, 0.01)
    for profile, stop in (("trainer", 1e-4), ("engine", 0)):
        got, want = one.drawn(profile), one.picture(profile)
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
        assert one.drawn(profile).evaluations == 16 < one.picture(profile).evaluations


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


@pytest.mark.parametrize("workers", [1, 2, 3, 50])
@pytest.mark.parametrize("worth", [0, 10**9])
def test_tile_lists_are_the_references(workers: int, worth: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Filled by one worker, or by bands of tile rows, some of them empty."""
    monkeypatch.setattr(cpu_tiles, "WORTH_A_THREAD", worth)
    one = scene(16, 3000, 0.1, (120, 90))
    screen, order = one.screen(workers=workers), sort(one.reference())
    ids, starts = cpu_tiles.tile_lists(
        screen.tiles, order.astype(np.uint32), screen.counts.sum(axis=0), 8, workers
    )
    want, ranges = reference_lists(one.reference().tiles, order, one.camera, 16)
    np.testing.assert_array_equal(ids, want)
    np.testing.assert_array_equal(np.stack([starts[:-1], starts[1:]], axis=1), ranges)


DEPTHS = st.one_of(
    st.floats(width=32, allow_nan=False), st.sampled_from([0.0, -0.0, 1.0, float(np.nextafter(1, 2))])
)


@settings(deadline=None)
@given(st.lists(st.tuples(DEPTHS, st.integers(0, 2)), max_size=60))
def test_sort_is_lexsort(rows: list[tuple[float, int]]) -> None:
    depth = np.array([row[0] for row in rows], np.float32)
    radius = np.array([row[1] for row in rows], np.int32)
    by_depth = np.lexsort((np.arange(len(rows)), depth))
    assert cpu_sort(depth, radius).tolist() == [i for i in by_depth if radius[i] != 0]


@pytest.mark.parametrize("spread", [0.0, 1e-6, 1e-3, 1.0, 1e6])
def test_sort_of_many(spread: float) -> None:
    """From keys that share all bits to keys that share none: 0 to 3 passes."""
    rng = np.random.default_rng(4)
    depth = (2 + spread * rng.normal(size=20_000)).astype(np.float32)
    radius = rng.integers(0, 3, len(depth)).astype(np.int32)
    want = np.lexsort((np.arange(len(depth)), depth))
    np.testing.assert_array_equal(cpu_sort(depth, radius), want[radius[want] != 0])


@pytest.mark.parametrize("profile", PROFILES)
def test_stages_take_the_golden_inputs_alone(profile: str) -> None:
    """From read-only arrays, some of them not contiguous."""
    avatar = full_avatar(1)
    one = scene(17, 100, degree=avatar.sh_degree)
    rotation = np.eye(3, dtype=np.float32) + 0 * one.splats.mean[:, :1, None]
    inputs = {
        name: np.asfortranarray(getattr(one.splats, name))
        for name in ("mean", "scale", "quat_wxyz", "opacity", "sh")
    } | {"sh_rotation": rotation if one.splats.sh_rotation is None else one.splats.sh_rotation}
    for array in inputs.values():
        array.setflags(write=False)
    want = project(Splats(**inputs), one.camera, avatar.raster, avatar.sh_degree)
    out = STAGES["project"](avatar, inputs, one.camera, profile, 2)
    assert list(out) == ["centre", "depth", "conic", "opacity", "rgb", "radius"]
    for name, got in out.items():
        np.testing.assert_allclose(got, getattr(want, name), rtol=0, atol=COLOUR_TOLERANCE, err_msg=name)
    order = STAGES["sort"](avatar, out, None, profile, 2)
    assert order["order"].dtype == np.int64
    np.testing.assert_array_equal(order["order"], sort(want))
    got = STAGES["raster"](avatar, out | order | {"background": SKY}, one.camera, profile, 2)
    picture = raster(want, sort(want), one.camera, SKY, profile)
    np.testing.assert_allclose(got["colour"], picture.colour, rtol=0, atol=1e-5)
    np.testing.assert_allclose(got["transmittance"], picture.transmittance, rtol=0, atol=1e-5)


def test_raster_draws_the_splats_that_the_order_names() -> None:
    one = scene(18)
    p = one.reference()
    order = sort(p)[::3]
    arrays = {name: getattr(p, name) for name in ("centre", "conic", "opacity", "rgb", "radius")}
    inputs = arrays | {"order": order, "background": SKY}
    got = STAGES["raster"](full_avatar(1), inputs, one.camera, "trainer", 1)
    want = raster(p, order, one.camera, SKY, "trainer")
    np.testing.assert_allclose(got["colour"], want.colour, rtol=0, atol=1e-5)
    for wrong in ([-1], [len(p.radius)]):
        with pytest.raises(ValueError, match="beyond the 300"):
            STAGES["raster"](full_avatar(1), inputs | {"order": np.array(wrong)}, one.camera, "trainer", 1)


@pytest.mark.parametrize("name", ["mean", "scale", "quat_wxyz", "opacity", "sh", "sh_rotation"])
def test_arrays_that_do_not_fit_are_the_callers_mistake(name: str) -> None:
    """A kernel would read beyond their ends."""
    one = scene(20, 10, degree=1)
    array = getattr(one.splats, name)
    shorter = [array[:-1]] + ([array[:, :-1]] if array.ndim > 1 else [])
    for wrong in shorter:
        with pytest.raises(ValueError, match=" not "):
            replace(one, splats=replace(one.splats, **{name: wrong})).drawn("trainer")


def test_time_goes_to_the_stages() -> None:
    clock, one = Clock(), scene(19)
    s = one.splats
    draw(
        *(s.mean, s.scale, s.quat_wxyz, s.opacity, s.sh, None, one.camera, RasterSettings()),
        *(0, BLACK, "trainer", 1, clock),
    )
    assert list(clock.milliseconds) == ["project", "sort", "raster"]


def test_unknown_profile_is_the_callers_mistake() -> None:
    with pytest.raises(ValueError, match="trainer, engine"):
        scene(1).drawn("fast")
