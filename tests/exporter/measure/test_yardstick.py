"""Figures of one avatar against another: PSNR by a formula of the test's own."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.measure.poses import poses
from avatar_export.measure.views import Shot, views
from avatar_export.measure.yardstick import Yardstick
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from tests.avatars import full_avatar

SIZE = 24


@pytest.fixture(scope="module")
def source() -> Avatar:
    return full_avatar()


@pytest.fixture(scope="module")
def shots(source: Avatar) -> list[Shot]:
    """Three poses of two kinds, each through three views."""
    chosen = [replace(named, kind=kind) for named, kind in zip(poses(source)[1::3], "aab", strict=True)]
    return [Shot(named, view) for named in chosen for view in views(source, SIZE, chosen)]


@pytest.fixture(scope="module")
def yardstick(source: Avatar, shots: list[Shot]) -> Yardstick:
    return Yardstick(source, shots, "reference")


def moved(avatar: Avatar, metres: float) -> Avatar:
    """The avatar with one Gaussian that no joint moves shifted along x, and other colours."""
    mean, sh = avatar.gaussians.mean.copy(), avatar.gaussians.sh + np.float32(0.01)
    mean[-1, 0] += metres
    return replace(avatar, gaussians=replace(avatar.gaussians, mean=mean, sh=sh))


def decibel(error: npt.NDArray[np.float64]) -> float:
    """-10 log10 of the mean of the squares, one number at a time."""
    squares = [float(e) ** 2 for e in error.ravel()]
    return -10 * math.log10(math.fsum(squares) / len(squares))


def test_figures_are_those_of_the_formula(source: Avatar, shots: list[Shot], yardstick: Yardstick) -> None:
    other = moved(source, 0.01)
    measured = yardstick.measure(other)
    whole, inside, largest = [], [], []
    for shot in shots:
        a, b = (
            Player(x, "reference").frame(shot.pose.pose, shot.view.camera, (0.0, 0.0, 0.0)).image
            for x in (source, other)
        )
        error = b.colour.astype(np.float64) - a.colour
        mask = 1 - a.transmittance > 0.5
        whole.append(decibel(error))
        inside.append(decibel(error[mask]))
        largest.append(max(abs(float(e)) for e in error[mask].ravel()))
    np.testing.assert_allclose(measured.whole, whole, rtol=1e-6)
    np.testing.assert_allclose(measured.inside, inside, rtol=1e-6)
    np.testing.assert_allclose(measured.largest, largest, rtol=1e-5)
    assert measured.mean == pytest.approx(min(np.mean(inside[:6]), np.mean(inside[6:])), rel=1e-6)
    assert measured.worst == pytest.approx(min(inside), rel=1e-6)
    assert measured.worst_pixel == pytest.approx(max(largest), rel=1e-5)
    assert measured.region == "inside the outline" and measured.worst <= measured.mean
