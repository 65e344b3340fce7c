"""Figures of one avatar against another: PSNR by a formula of the test's own, distances, and what has no figure."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.measure.poses import poses
from avatar_export.measure.views import Shot, views
from avatar_export.measure.yardstick import LARGEST_DB, Yardstick, compare, distance, pairs, psnr
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends.reference import ReferenceBackend
from avatar_runtime.player import Player
from avatar_runtime.stages.activate import Splats
from avatar_runtime.subset import subset
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


def test_the_mean_is_that_of_the_kind_that_comes_out_worst(yardstick: Yardstick, source: Avatar) -> None:
    inside = np.array([60.0, 62, 61, 60, 62, 61, 50, 54, 55])
    measured = replace(yardstick.measure(source), inside=inside, whole=inside + 10)
    assert (measured.mean, measured.worst) == (53.0, 50.0)
    assert measured.by_kind() == [("a", 61.0, 0), ("b", 53.0, 6)]
    found = measured.as_json()
    assert found["psnr_mask_db"] == {"mean": 53.0, "worst": 50.0}
    assert found["kinds"][1] == {
        "name": "b",
        "shots": 3,
        "mean_db": 53.0,
        "worst_db": 50.0,
        "worst_shot": measured.shots[6],
    }


def test_the_background_of_training_plays_no_part(yardstick: Yardstick, source: Avatar) -> None:
    bright = replace(source, raster=replace(source.raster, background=(1.0, 1.0, 1.0)))
    assert (yardstick.measure(bright).whole == LARGEST_DB).all()


def test_the_largest_distance_of_posed_positions(source: Avatar, yardstick: Yardstick) -> None:
    measured = yardstick.measure(moved(source, 0.01))  # nothing scales the group `hair`
    assert measured.position_error is not None
    np.testing.assert_allclose(measured.position_error[::4], 0.01, rtol=1e-5)
    assert np.isnan(measured.position_error[1:4]).all(), "one shot of four compares positions"


def test_an_avatar_of_fewer_gaussians_has_no_position_error(source: Avatar, yardstick: Yardstick) -> None:
    assert source.rig is not None
    fewer = subset(source, np.arange(0, source.gaussians.count, 2), source.rig.anchor_vertices).avatar
    measured = yardstick.measure(fewer)
    assert measured.position_error is None and measured.mean < 60
    assert measured.as_json()["position_error"] is None


def test_the_json_says_which_pose_is_worst(yardstick: Yardstick, source: Avatar) -> None:
    measured = yardstick.measure(moved(source, 0.01))
    errors = np.full(9, np.nan)
    errors[[0, 4, 8]] = 1e-3, 3e-3, 2e-3
    found = replace(measured, position_error=errors).as_json()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["position_error"] == {"metres": 3e-3, "pose": measured.shots[4]}
    whole = measured.whole.tolist()
    assert found["psnr_db"] == {"mean": round(sum(whole) / 9, 3), "worst": round(min(whole), 3)}
    assert found["pixel_mask"] == pytest.approx(measured.worst_pixel, rel=1e-5)
    assert (found["size"], found["backend"], found["profile"]) == ([SIZE, SIZE], "reference", "trainer")


def test_no_figure_inside_where_the_source_covers_nothing(source: Avatar, shots: list[Shot]) -> None:
    clear = replace(
        source,
        gaussians=replace(source.gaussians, opacity_logit=source.gaussians.opacity_logit - 10),
    )
    measured = compare(clear, [source], shots[:1], "reference")[0]
    assert measured.region == "of the whole image" and measured.mean == measured.worst == measured.whole[0]
    assert measured.worst_pixel is None
    assert measured.as_json()["psnr_mask_db"] == {"mean": None, "worst": None}
    json.dumps(measured.as_json(), allow_nan=False)


def test_several_at_once_are_measured_as_one_by_one(
    source: Avatar, shots: list[Shot], yardstick: Yardstick
) -> None:
    others = [source, moved(source, 0.01)]
    for other, measured in zip(others, compare(source, others, shots, "reference"), strict=True):
        assert measured.as_json() == yardstick.measure(other).as_json()
    first = yardstick.first(2).measure(others[1])
    np.testing.assert_array_equal(first.inside, yardstick.measure(others[1]).inside[:2])


def test_a_broken_avatar_gets_the_lowest_figure(source: Avatar, yardstick: Yardstick) -> None:
    mean = np.full_like(source.gaussians.mean, np.nan)
    assert distance(source.gaussians.mean, mean) == np.inf
    image = np.zeros((2, 2, 3), np.float32)
    broken = psnr(image, np.ones((2, 2), bool), image + np.float32(np.nan))
    assert broken == (-LARGEST_DB, -LARGEST_DB, np.inf)
    found = replace(yardstick.measure(source), position_error=np.array([0.0, np.inf, 0.0])).as_json()
    assert found["position_error"] == {"metres": None, "pose": yardstick.shots[1].name}


def test_each_image_is_drawn_once(monkeypatch: pytest.MonkeyPatch, source: Avatar, shots: list[Shot]) -> None:
    count = {"frame": 0, "animate": 0}
    for name in count:
        plain: Callable[..., Splats] = getattr(ReferenceBackend, name)

        def counted(
            self: ReferenceBackend, *args: Any, name: str = name, plain: Callable[..., Splats] = plain
        ) -> Splats:
            count[name] += 1
            return plain(self, *args)

        monkeypatch.setattr(ReferenceBackend, name, counted)
    yardstick = Yardstick(source, shots, "reference")
    yardstick.measure(source)
    yardstick.measure(source)
    assert count["frame"] == 3 * len(shots)


def test_pairs_are_the_images_that_were_measured(
    yardstick: Yardstick, source: Avatar, shots: list[Shot]
) -> None:
    other = moved(source, 0.01)
    measured = yardstick.measure(other)
    for at, pair in enumerate(pairs(source, other, shots, "reference")):
        found = psnr(pair.source, pair.mask, pair.other)
        assert found == (measured.whole[at], measured.inside[at], measured.largest[at])


def test_no_shot_is_refused(source: Avatar) -> None:
    with pytest.raises(ValueError, match="one shot"):
        Yardstick(source, [], "reference")


def test_a_claim_leaves_room_for_rare_images(source: Avatar, yardstick: Yardstick) -> None:
    """Three standard deviations, about the means of the kinds, below the worst; or the allowance below the mean."""
    measured = yardstick.measure(moved(source, 0.003))
    told = np.array([60.0, 61, 62, 60, 61, 62, 70, 71, 72])  # kind a: 61, kind b: 71
    spread = replace(measured, whole=told, inside=told)
    assert [mean for _, mean, _ in spread.by_kind()] == [61, 71]
    assert spread.worst == 60
    assert replace(spread, allowance=1.0).worst == pytest.approx(60 - 3 * math.sqrt(2 / 3))
    assert replace(spread, allowance=9.0).worst == 52
