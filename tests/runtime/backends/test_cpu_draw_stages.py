"""Stages project, sort and raster of the `cpu` backend each alone: tile lists, sort orders, arguments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_runtime.stages.raster import raster
from avatar_runtime.stages.raster import tile_lists as reference_lists
from avatar_runtime.stages.sort import sort
from tests.avatars import full_avatar

pytest.importorskip("numba")
from avatar_runtime.backends.cpu.draw import tiles as cpu_tiles
from avatar_runtime.backends.cpu.draw.frame import RUN
from avatar_runtime.backends.cpu.draw.sort import sort as cpu_sort
from tests.runtime.backends.cpu_scenes import SKY, scene


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


def test_raster_draws_the_splats_that_the_order_names() -> None:
    one = scene(18)
    p = one.reference()
    order = sort(p)[::3]
    arrays = {name: getattr(p, name) for name in ("centre", "conic", "opacity", "rgb", "radius")}
    inputs = arrays | {"order": order, "background": SKY}
    got = RUN["raster"](full_avatar(1), inputs, one.camera, "trainer", 1)
    want = raster(p, order, one.camera, SKY, "trainer")
    np.testing.assert_allclose(got["colour"], want.colour, rtol=0, atol=1e-5)
    for wrong in ([-1], [len(p.radius)]):
        with pytest.raises(ValueError, match="beyond the 300"):
            RUN["raster"](full_avatar(1), inputs | {"order": np.array(wrong)}, one.camera, "trainer", 1)


@pytest.mark.parametrize("name", ["mean", "scale", "quat_wxyz", "opacity", "sh", "sh_rotation"])
def test_arrays_that_do_not_fit_are_the_callers_mistake(name: str) -> None:
    """A kernel would read beyond their ends."""
    one = scene(20, 10, degree=1)
    array = getattr(one.splats, name)
    shorter = [array[:-1]] + ([array[:, :-1]] if array.ndim > 1 else [])
    for wrong in shorter:
        with pytest.raises(ValueError, match=" not "):
            replace(one, splats=replace(one.splats, **{name: wrong})).drawn("trainer")


def test_unknown_profile_is_the_callers_mistake() -> None:
    for draw_by in (scene(1).drawn, scene(1).image):
        with pytest.raises(ValueError, match="trainer, engine"):
            draw_by("fast")
