"""The search: aims and sizes that can be reached, and those that cannot."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import cast

import pytest

from avatar_export.measure.claims import search_poses
from avatar_export.measure.views import in_turn, views
from avatar_export.measure.yardstick import Measured, Yardstick
from avatar_export.notes.note import fact
from avatar_export.packing.balance import DEPTHS, Balance, balanced
from avatar_export.packing.quantise import quantised
from avatar_export.packing.search import EXPRESSIVE, STILL, Aims, Found, aims_of, by_aims, by_size
from avatar_export.packing.steps import KEPT_FINE, STEPS, Fineness
from avatar_runtime.avatar import Avatar
from avatar_runtime.codec.pack import PackFile, encode
from avatar_runtime.program.bake import bake
from tests.avatars import full_avatar


def size(levels: Sequence[Avatar], fine: Fineness) -> int:
    """What the search is given: the size of the buffers in a file."""
    return len(encode(PackFile({}, bake(*quantised(levels[0], fine))))[0])


@cache
def yardstick() -> Yardstick:
    """Small images of a small avatar."""
    shown = search_poses(full_avatar())
    return Yardstick(full_avatar(), in_turn(shown, views(full_avatar(), 40, shown)), "reference")


@cache
def balance() -> Balance:
    """The balance of the small avatar."""
    return balanced(full_avatar(), yardstick())


@pytest.fixture(autouse=True)
def _balanced_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avatar_export.packing.search.balanced", lambda *_: balance())


@cache
def usual_size() -> int:
    """The bytes of a pack with the steps in balance."""
    return size([full_avatar()], balance().fine(0.0))


@cache
def of_size(max_bytes: int) -> Found:
    """A search for a size."""
    return by_size([full_avatar()], max_bytes, yardstick(), size)


@cache
def for_mean(mean: float) -> Found:
    """A search for a mean."""
    return by_aims([full_avatar()], Aims(mean, mean - 8), yardstick())


def measured(found: Found) -> Measured:
    """The figures of what was found."""
    return yardstick().measure(quantised(found.levels[0], found.fine)[0])


def test_the_best_pack_that_fits_a_size() -> None:
    less, more = usual_size() - 500, usual_size() + 300
    for limit in (less, more):
        assert 0.98 * limit <= size(of_size(limit).levels, of_size(limit).fine) <= limit
    assert measured(of_size(more)).mean > measured(of_size(less)).mean


def test_the_smallest_pack_that_is_good_enough() -> None:
    coarse, fine = for_mean(45.0), for_mean(60.0)
    for found, mean in ((coarse, 45.0), (fine, 60.0)):
        assert measured(found).mean >= mean and measured(found).worst >= mean - 8
    assert measured(coarse).mean < 60 and size(coarse.levels, coarse.fine) < size(fine.levels, fine.fine)


def test_a_worst_image_below_the_aim_makes_steps_finer() -> None:
    found = by_aims([full_avatar()], Aims(10.0, 55.0), yardstick())
    assert (
        measured(found).worst >= 55 > measured(by_aims([full_avatar()], Aims(10.0, 5.0), yardstick())).worst
    )


def test_steps_stay_as_usual_where_no_more_is_asked_for() -> None:
    assert by_aims([full_avatar()], Aims(20.0, 10.0), yardstick(), 0.0).octaves == pytest.approx(0, abs=0.05)
    assert by_aims([full_avatar()], Aims(20.0, 10.0), yardstick()).octaves > 1


def test_targets_out_of_reach_give_the_nearest() -> None:
    small = of_size(100)
    assert size(small.levels, small.fine) > 100
    assert small.levels[0].sh_degree == 0, "spherical harmonics go before it gives up"
    assert measured(for_mean(149.0)).mean > measured(for_mean(60.0)).mean


def test_gaussians_go_last_and_parts_that_cannot_be_small_enough_are_passed_over() -> None:
    asked = []

    def coarser(avatar: Avatar, part: float) -> Avatar:
        asked.append((avatar.sh_degree, part))
        return replace(avatar, name="c")

    by_size([full_avatar()], 100, yardstick(), size, coarser)
    assert asked == [(0, 0.1)], "each part takes as long as a level of detail"


def test_the_same_input_gives_the_same_result() -> None:
    again = by_size([full_avatar()], usual_size() - 500, yardstick(), size)
    assert again.record() == of_size(usual_size() - 500).record()


def test_the_record_is_json_and_says_what_was_chosen() -> None:
    one = of_size(usual_size() - 500)
    record = json.loads(json.dumps(one.record()))
    assert record["steps"]["gaussians.sh"] == pytest.approx(one.fine.step("gaussians.sh"), rel=1e-3)
    assert fact("tried", count=record["tried"]) in one.notes(full_avatar())


def test_finer_steps_make_up_for_what_is_missing() -> None:
    one = for_mean(45.0)
    assert measured(one.finer(3.0)).mean >= measured(one).mean + 2.5


def test_an_attribute_that_shows_more_gets_finer_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    found = balance().factors
    monkeypatch.setitem(cast(dict[str, float], STEPS), "gaussians.sh", 8 * STEPS["gaussians.sh"])
    other = balanced(full_avatar(), yardstick()).factors
    sh, usual = "gaussians.sh", "gaussians.log_scale"
    assert other[sh] / other[usual] == pytest.approx(found[sh] / found[usual] / 8, rel=0.4)
    assert all(found[path] <= 1 for path in DEPTHS if path in found)


def test_meshes_and_skin_weights_are_never_coarser_than_usual() -> None:
    coarse = Balance(dict.fromkeys(KEPT_FINE, 1.0), 0.0).fine(5.0).factors
    assert coarse == dict.fromkeys(KEPT_FINE, 1.0)


def test_aims_depend_on_what_moves() -> None:
    avatar = full_avatar()
    assert aims_of(avatar, None) == EXPRESSIVE and aims_of(replace(avatar, expressions=()), None) == STILL
    assert aims_of(avatar, 50.0) == Aims(50.0, 45.0)
