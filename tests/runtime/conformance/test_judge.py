"""What passes and what fails, at the edge of each tolerance and of each threshold that may flip."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from avatar_runtime.conformance.judge import Element, Verdict, judge
from avatar_runtime.conformance.model import Expected, Step

WANT = np.array([[1.0, -2.0], [4.0, 0.5]])


def verdict(got: Any, want: Any = WANT, **said: Any) -> Verdict:
    """Of one output of some stage."""
    expected = Expected(**{"tensor": "want", "atol": 0.0, "rtol": 0.0, **said})
    tensors = {"want": np.asarray(want), "weight": np.array([1.0, 3.0])}
    return judge(Step("any", None, {}, {"a": expected}), {"a": np.asarray(got)}, tensors)["a"]


def moved(element: int, by: float) -> Any:
    """WANT with one element, counted row by row, off."""
    got = WANT.copy()
    got.ravel()[element] += by
    return got


def test_equal_values_pass_without_any_tolerance() -> None:
    assert verdict(WANT) == Verdict(0.0, 0.0, 0, 0) and verdict(WANT).passed


@pytest.mark.parametrize(("off", "passes"), [(0.0099, True), (0.0101, False), (-0.0101, False)])
def test_an_absolute_tolerance(off: float, passes: bool) -> None:
    found = verdict(moved(2, off), atol=0.01)
    assert found.passed == passes
    assert found.error == pytest.approx(abs(off)) and found.used == pytest.approx(abs(off) / 0.01)


def test_a_relative_tolerance_is_that_of_the_element() -> None:
    assert verdict(WANT * 1.009, rtol=0.01).passed
    assert not verdict(moved(3, 0.01), rtol=0.01).passed  # of 0.5, though it would do for 4


def test_a_weight_is_that_of_the_row() -> None:
    assert verdict(moved(2, 0.029), atol=0.01, weight="weight").passed
    assert not verdict(moved(0, 0.011), atol=0.01, weight="weight").passed


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_fails(bad: float) -> None:
    got = WANT.copy()
    got[1, 0] = bad
    for flips in (None, "sign", "cutoff"):
        assert not verdict(got, atol=1e9, flips=flips, most_flips=9).passed
    for want in (5, 0):
        assert not verdict(np.array([3.0, bad]), [3, want], flips="drawn", most_flips=9).passed


@pytest.mark.parametrize("got", [WANT[:1], WANT[:, :1], WANT.ravel(), WANT[None]])
def test_another_shape_fails_and_says_so(got: Any) -> None:
    found = verdict(got, atol=1e9)
    assert not found.passed and "expected [2, 2]" in found.note


def test_the_worst_element_is_the_one_that_takes_up_most() -> None:
    assert verdict(moved(2, 0.02), atol=0.01).worst == Element((1, 0), 4.02, 4.0, 0.01)
    assert verdict(moved(2, 0.02), atol=0.01, weight="weight").worst == Element((1, 0), 4.02, 4.0, 0.03)
    got = moved(2, 0.02)
    got[0, 0] += 0.019
    assert verdict(got, atol=0.01, weight="weight").worst == Element((0, 0), 1.019, 1.0, 0.01)
    flips = verdict([3, 6, 0, 8], np.array([3, 5, 0, 7]), flips="drawn", most_flips=1)
    assert flips.worst == Element((1,), 6.0, 5.0, 0.0)
    assert verdict(np.zeros((0, 2)), np.zeros((0, 2)), flips="cutoff").worst is None


def test_an_output_that_is_not_given_fails() -> None:
    step = Step("any", None, {}, {"a": Expected("want", 1e9, 0.0)})
    found = judge(step, {}, {"want": WANT})["a"]
    assert not found.passed and "nothing" in found.note


def test_a_quaternion_may_have_either_sign_row_by_row() -> None:
    assert verdict(WANT * [[-1], [1]], flips="sign").passed
    assert not verdict(WANT * [[-1, 1], [1, 1]], flips="sign").passed
    assert not verdict(WANT * [[-1], [1]]).passed


def test_a_radius_may_be_one_off_in_few_rows() -> None:
    want = np.array([3, 5, 0, 7])
    assert verdict([3, 6, 0, 7], want, flips="drawn", most_flips=1) == Verdict(0.0, 0.0, 1, 1)
    assert verdict([3, 4, 0, 7], want, flips="drawn", most_flips=1).passed
    assert verdict([3, 5, 9, 7], want, flips="drawn", most_flips=1).passed  # on the border: drawn or not
    assert not verdict([3, 6, 0, 8], want, flips="drawn", most_flips=1).passed
    assert not verdict([3, 7, 0, 7], want, flips="drawn", most_flips=4).passed


def project(radius: list[int], depth: list[float], **said: Any) -> dict[str, Verdict]:
    outputs = {
        "radius": Expected("radius", 0.0, 0.0, flips="drawn", most_flips=1),
        "depth": Expected("depth", 0.0, 0.0),
    }
    tensors = {"radius": np.array([3, 0, 5]), "depth": np.array([1.0, 0.0, 2.0])}
    return judge(
        Step("project", None, {}, outputs), {"radius": np.array(radius), "depth": np.array(depth)}, tensors
    )


def test_rows_that_are_drawn_in_one_alone_are_judged_by_their_radius() -> None:
    assert all(v.passed for v in project([3, 4, 5], [1, 0.7, 2]).values())
    assert not project([3, 0, 5], [1, 0.7, 2])["depth"].passed
    everything_gone = project([0, 0, 0], [0, 0, 0])
    assert not everything_gone["radius"].passed and everything_gone["depth"].passed


def raster(colour: list[float], brightest: float = 1.0, most: int = 1) -> Verdict:
    step = Step(
        "raster",
        "engine",
        {"rgb": "rgb"},
        {"colour": Expected("c", 1e-5, 0.0, flips="cutoff", most_flips=most)},
    )
    tensors = {"c": np.full((4, 1), 0.5), "rgb": np.array([[brightest, 0, 0]])}
    return judge(step, {"colour": np.array(colour)[:, None]}, tensors)["colour"]


def test_a_pixel_may_lie_beyond_a_threshold_by_no_more_than_it_explains() -> None:
    assert raster([0.5, 0.5, 0.5039, 0.5]) == Verdict(0.0, 0.0, 1, 1)
    assert not raster([0.5, 0.5, 0.5041, 0.5]).passed
    assert raster([0.5, 0.5, 0.509, 0.5], brightest=3.0).passed
    assert not raster([0.5, 0.5039, 0.5039, 0.5]).passed
    assert raster([0.500009, 0.5, 0.5, 0.5], most=0).passed
