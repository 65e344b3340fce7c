"""glTF samplers: STEP, LINEAR, rotations and CUBICSPLINE, by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from avatar_export.formats.gltf.sampler import Sampler, evaluate

QUARTER = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # 90 degrees about Z, xyzw


def sampler(
    values: Any, interpolation: str, rotation: bool = False, times: tuple[float, ...] = (1.0, 3.0)
) -> Sampler:
    return Sampler(np.array(times), np.array(values, float), interpolation, rotation)


def test_step_and_linear() -> None:
    at = np.array([0.0, 1.0, 1.5, 2.999, 3.0, 9.0])
    assert evaluate(sampler([[0], [8]], "STEP"), at)[:, 0].tolist() == [0, 0, 0, 0, 8, 8]
    assert evaluate(sampler([[0], [8]], "LINEAR"), at)[:, 0] == pytest.approx([0, 0, 2, 7.996, 8, 8])
    three = sampler([[0], [8], [2]], "LINEAR", times=(0.0, 1.0, 4.0))
    assert evaluate(three, np.array([0.5, 1.0, 2.0, 4.0]))[:, 0] == pytest.approx([4, 8, 6, 2])
    assert evaluate(sampler([[5]], "LINEAR", times=(1.0,)), at)[:, 0].tolist() == [5] * 6


def test_rotations_go_by_the_shorter_arc_at_constant_speed() -> None:
    for end in (QUARTER, [-v for v in QUARTER]):
        q = evaluate(sampler([[0, 0, 0, 1], end], "LINEAR", True), np.array([1.0, 1.5, 2.0, 3.0]))
        angles = 2 * np.degrees(np.arctan2(q[:, 2], q[:, 3]))
        assert angles == pytest.approx([0, 22.5, 45, 90])
    same = evaluate(sampler([QUARTER, QUARTER], "LINEAR", True), np.array([1.7]))
    assert same[0] == pytest.approx(QUARTER)


def test_cubic_spline_by_hand() -> None:
    # Keys 0 at t=1 with out-tangent 1 and 4 at t=3 with in-tangent -2; td = 2. At u = 1/2:
    # 0.5*0 + 2*0.125*1 + 0.5*4 + 2*(-0.125)*(-2) = 2.75
    cubic = sampler([[[9], [0], [1]], [[-2], [4], [9]]], "CUBICSPLINE")
    assert evaluate(cubic, np.array([0.0, 1.0, 2.0, 3.0, 5.0]))[:, 0] == pytest.approx([0, 0, 2.75, 4, 4])
    zero = [0.0] * 4
    turn = sampler([[zero, [0, 0, 0, 1], zero], [zero, QUARTER, zero]], "CUBICSPLINE", True)
    assert evaluate(turn, np.array([2.0]))[0] == pytest.approx([0, 0, np.sin(np.pi / 8), np.cos(np.pi / 8)])
