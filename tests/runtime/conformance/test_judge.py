"""What passes and what fails, at the edge of each tolerance and of each threshold that may flip."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from avatar_runtime.conformance.judge import Verdict, judge
from avatar_runtime.conformance.model import Expected, Step

WANT = np.array([[1.0, -2.0], [4.0, 0.5]])
RADII = np.array([3, 5, 0, 7])
DRAWN = {"flips": "drawn", "most_flips": 1}
ROWWISE = {"atol": 0.01, "weight": "weight"}


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


@pytest.mark.parametrize(
    ("got", "want", "said", "passes"),
    [
        (WANT, WANT, {}, True),
        (moved(2, 0.0099), WANT, {"atol": 0.01}, True),
        (moved(2, 0.0101), WANT, {"atol": 0.01}, False),
        (moved(2, -0.0101), WANT, {"atol": 0.01}, False),
        (WANT * 1.009, WANT, {"rtol": 0.01}, True),
        (moved(3, 0.01), WANT, {"rtol": 0.01}, False),  # of 0.5, though it would do for 4
        (moved(2, 0.029), WANT, ROWWISE, True),
        (moved(0, 0.011), WANT, ROWWISE, False),
        (WANT * [[-1], [1]], WANT, {"flips": "sign"}, True),  # a quaternion has either sign, row by row
        (WANT * [[-1, 1], [1, 1]], WANT, {"flips": "sign"}, False),
        (WANT * [[-1], [1]], WANT, {}, False),
        ([3, 6, 0, 7], RADII, DRAWN, True),
        ([3, 4, 0, 7], RADII, DRAWN, True),
        ([3, 5, 9, 7], RADII, DRAWN, True),  # on the border: drawn or not
        ([3, 6, 0, 8], RADII, DRAWN, False),
        ([3, 7, 0, 7], RADII, {"flips": "drawn", "most_flips": 4}, False),
    ],
)
def test_tolerances_and_flips(got: Any, want: Any, said: dict[str, Any], passes: bool) -> None:
    assert verdict(got, want, **said).passed == passes


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_fails(bad: float) -> None:
    got = WANT.copy()
    got[1, 0] = bad
    for flips in (None, "sign", "cutoff"):
        assert not verdict(got, atol=1e9, flips=flips, most_flips=9).passed
    for want in (5, 0):
        assert not verdict(np.array([3.0, bad]), [3, want], flips="drawn", most_flips=9).passed


@pytest.mark.parametrize("got", [WANT[:1], WANT[:, :1], WANT.ravel(), WANT[None]])
def test_another_shape_or_nothing_fails_and_says_so(got: Any) -> None:
    found = verdict(got, atol=1e9)
    assert not found.passed and "expected [2, 2]" in found.note
    nothing = judge(Step("any", None, {}, {"a": Expected("want", 1e9, 0.0)}), {}, {"want": WANT})["a"]
    assert not nothing.passed and "nothing" in nothing.note


def project(radius: list[int], depth: list[float]) -> dict[str, Verdict]:
    outputs = {"radius": Expected("radius", 0.0, 0.0, **DRAWN), "depth": Expected("depth", 0.0, 0.0)}
    tensors = {"radius": np.array([3, 0, 5]), "depth": np.array([1.0, 0.0, 2.0])}
    given = {"radius": np.array(radius), "depth": np.array(depth)}
    return judge(Step("project", None, {}, outputs), given, tensors)


def test_rows_that_are_drawn_in_one_alone_are_judged_by_their_radius() -> None:
    assert all(v.passed for v in project([3, 4, 5], [1, 0.7, 2]).values())
    assert not project([3, 0, 5], [1, 0.7, 2])["depth"].passed
    everything_gone = project([0, 0, 0], [0, 0, 0])
    assert not everything_gone["radius"].passed and everything_gone["depth"].passed


def raster(colour: list[float], brightest: float = 1.0, most: int = 1) -> Verdict:
    expected = Expected("c", 1e-5, 0.0, flips="cutoff", most_flips=most)
    tensors = {"c": np.full((4, 1), 0.5), "rgb": np.array([[brightest, 0, 0]])}
    step = Step("raster", "engine", {"rgb": "rgb"}, {"colour": expected})
    return judge(step, {"colour": np.array(colour)[:, None]}, tensors)["colour"]


def test_a_pixel_may_lie_beyond_a_threshold_by_no_more_than_it_explains() -> None:
    assert raster([0.5, 0.5, 0.5039, 0.5]) == Verdict(0.0, 0.0, 1, 1)
    assert not raster([0.5, 0.5, 0.5041, 0.5]).passed
    assert raster([0.5, 0.5, 0.509, 0.5], brightest=3.0).passed
    assert not raster([0.5, 0.5039, 0.5039, 0.5]).passed
    assert raster([0.500009, 0.5, 0.5, 0.5], most=0).passed
