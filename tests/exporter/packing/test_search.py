"""The budget search: sizes and errors that can be reached, and those that cannot."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import cast

import numpy as np
import pytest

from avatar_export.measure.poses import poses
from avatar_export.measure.views import views
from avatar_export.measure.yardstick import Measured, Yardstick
from avatar_export.packing.curves import GRID, Curve, chosen, curves
from avatar_export.packing.quantise import quantised
from avatar_export.packing.search import Found, Target, search
from avatar_export.packing.steps import WEIGHTS, Fineness
from avatar_runtime.avatar import Avatar
from avatar_runtime.codec.pack import PackFile, encode
from avatar_runtime.program.bake import bake
from tests.avatars import full_avatar


def packed(levels: Sequence[Avatar], fine: Fineness) -> tuple[Avatar, int]:
    """What the search is given: the avatar as it will play, and the size of its buffers in a file."""
    avatar, codes = quantised(levels[0], fine)
    return avatar, len(encode(PackFile({}, bake(avatar, codes)))[0])


@cache
def measured() -> dict[str, Curve]:
    """The curves of the small avatar."""
    return curves(full_avatar(), yardstick())


@pytest.fixture(autouse=True)
def _curves_once(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    if "again" not in request.node.name:
        monkeypatch.setattr("avatar_export.packing.search.curves", lambda *_: measured())


@cache
def yardstick() -> Yardstick:
    """Two poses and one view of a small avatar, in small images."""
    shown = poses(full_avatar())[:2]
    return Yardstick(full_avatar(), shown, views(full_avatar(), 40, shown)[:1], "reference")


@cache
def default_size() -> int:
    """The bytes of a pack with the default steps."""
    return packed([full_avatar()], Fineness())[1]


@cache
def found(max_bytes: int | None = None, min_psnr: float | None = None) -> Found:
    """A search on the small avatar."""
    return search([full_avatar()], Target(max_bytes, min_psnr), yardstick(), packed)


def inside(of: Found) -> float:
    """Mean PSNR inside the mask."""
    assert of.measured.psnr_inside is not None
    return of.measured.psnr_inside


def test_the_best_pack_that_fits_a_size() -> None:
    small, large = found(default_size() - 500), found(default_size() + 300)
    assert small.met and small.bytes <= default_size() - 500
    assert large.met and large.bytes <= default_size() + 300
    assert inside(large) > inside(small)
    avatar, size = packed(large.levels, large.fine)
    assert size == large.bytes and yardstick().measure(avatar).psnr_inside == inside(large)


def test_the_smallest_pack_that_is_good_enough() -> None:
    coarse, fine = found(min_psnr=45.0), found(min_psnr=60.0)
    assert coarse.met and inside(coarse) >= 45
    assert fine.met and inside(fine) >= 60
    assert coarse.bytes < fine.bytes


def test_targets_out_of_reach_are_flagged() -> None:
    size, quality = found(100), found(min_psnr=149.0)
    assert not size.met and size.bytes > 100
    assert size.levels[0].sh_degree == 0, "spherical harmonics go before it gives up"
    assert not quality.met and inside(quality) > inside(found(min_psnr=60.0))


def test_gaussians_go_last() -> None:
    asked = []

    def coarser(avatar: Avatar, part: float) -> Avatar:
        asked.append((avatar.sh_degree, part))
        return replace(avatar, name="c")

    search([full_avatar()], Target(100), yardstick(), packed, coarser)
    assert asked and all(degree == 0 for degree, _ in asked)
    assert [part for _, part in asked] == sorted((part for _, part in asked), reverse=True)


def test_the_same_input_gives_the_same_result_again() -> None:
    again = search([full_avatar()], Target(default_size() - 500), yardstick(), packed)
    assert again.fine == found(default_size() - 500).fine
    assert again.record == found(default_size() - 500).record
    assert again.lines == found(default_size() - 500).lines


def test_the_record_is_json_and_says_what_was_chosen() -> None:
    one = found(default_size() - 500)
    record = json.loads(json.dumps(one.record))
    assert record["steps"]["gaussians.sh"] == pytest.approx(one.fine.step("gaussians.sh"), rel=1e-3)
    assert record["tried"][-1]["bytes"] >= one.bytes or len(record["tried"]) > 1
    assert f"{one.bytes} bytes" in one.lines[0]


def test_dearer_errors_buy_finer_steps() -> None:
    of = measured()
    cheap, dear = chosen(of, 2.0**6), chosen(of, 2.0**30)
    assert all(dear[path] <= cheap[path] for path in of)
    assert any(dear[path] < cheap[path] for path in of)
    assert all(cheap[path] <= 1 for path in WEIGHTS if path in of)
    assert all(np.all(np.diff(curve.bytes) <= 0) for curve in of.values())


class Fake:
    """An avatar of two attributes that are worth nothing but bytes and a figure, for the search alone."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, worst: float = 60.0) -> None:
        # Bytes fall slower and slower, then fast: no price gives what lies between the ends of "gaussians.sh".
        octaves = GRID - GRID[0]
        concave = Curve(1000 * (8 - octaves) ** 0.5, 1e-3 * 2.0 ** (0.1 * octaves))
        even = Curve(10 * 2.0**-GRID, 1e-6 * 2.0 ** (2 * GRID))
        self.curves = {"gaussians.sh": concave, "gaussians.mean": even}
        self.worst, self.steps = worst, []
        monkeypatch.setattr("avatar_export.packing.search.curves", lambda *_: self.curves)

    def pack(self, levels: Sequence[Avatar], fine: Fineness) -> tuple[Avatar, int]:
        """The bytes that the curves promise."""
        assert fine.factors is not None
        self.steps.append(fine.step("gaussians.mean"))
        at = {path: GRID[np.argmin(np.abs(2.0**GRID - factor))] for path, factor in fine.factors.items()}
        return levels[0], round(sum(np.interp(at[path], GRID, c.bytes) for path, c in self.curves.items()))

    def measure(self, _: Avatar) -> Measured:
        """60 dB everywhere, but for one image of the first pack that is measured."""
        inside = np.full((2, 2), 60.0)
        inside[1, 0], self.worst = self.worst, 60.0
        return Measured(("a", "b"), ("c", "d"), inside, inside, None, (8, 8), "none", "none")


@pytest.mark.parametrize("share", [0.6, 0.75, 0.9])
def test_a_budget_is_used_where_no_price_leads(monkeypatch: pytest.MonkeyPatch, share: float) -> None:
    fake = Fake(monkeypatch)
    limit = round(share * fake.curves["gaussians.sh"].bytes.max())
    one = search([full_avatar()], Target(limit), cast(Yardstick, fake), fake.pack)
    assert 0.97 * limit <= one.bytes <= limit


def test_an_image_far_worse_than_the_others_is_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    fake = Fake(monkeypatch, worst=40.0)
    limit = round(0.6 * fake.curves["gaussians.sh"].bytes.max())
    one = search([full_avatar()], Target(limit), cast(Yardstick, fake), fake.pack)
    assert one.measured.worst_inside == 60.0 and one.bytes <= limit
    assert fake.steps[-1] != fake.steps[-2] and one.fine.step("gaussians.mean") == fake.steps[-1]


@pytest.mark.parametrize("given", [{}, {"max_bytes": 1, "min_psnr": 1.0}])
def test_exactly_one_target(given: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="either"):
        Target(**given)
