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

from avatar_export.measure.poses import NamedPose, poses
from avatar_export.measure.views import NamedView, views
from avatar_export.measure.yardstick import LARGEST_DB, Yardstick, compare, distance, psnr
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
def chosen(source: Avatar) -> list[NamedPose]:
    return poses(source)[1::3]


@pytest.fixture(scope="module")
def cameras(source: Avatar, chosen: list[NamedPose]) -> list[NamedView]:
    return views(source, SIZE, chosen)


@pytest.fixture(scope="module")
def yardstick(source: Avatar, chosen: list[NamedPose], cameras: list[NamedView]) -> Yardstick:
    return Yardstick(source, chosen, cameras, "reference")


def moved(avatar: Avatar, metres: float) -> Avatar:
    """The avatar with one Gaussian that no joint moves shifted along x, and other colours."""
    mean, sh = avatar.gaussians.mean.copy(), avatar.gaussians.sh + np.float32(0.01)
    mean[-1, 0] += metres
    return replace(avatar, gaussians=replace(avatar.gaussians, mean=mean, sh=sh))


def decibel(error: npt.NDArray[np.float64]) -> float:
    """-10 log10 of the mean of the squares, one number at a time."""
    squares = [float(e) ** 2 for e in error.ravel()]
    return -10 * math.log10(math.fsum(squares) / len(squares))


def test_figures_are_those_of_the_formula(
    source: Avatar, chosen: list[NamedPose], cameras: list[NamedView], yardstick: Yardstick
) -> None:
    other = moved(source, 0.01)
    measured = yardstick.measure(other)
    assert measured.whole.shape == measured.inside.shape == (3, 3)
    whole, inside = [], []
    for named in chosen:
        for view in cameras:
            a, b = (
                Player(x, "reference").frame(named.pose, view.camera, (0.0, 0.0, 0.0)).image
                for x in (source, other)
            )
            error = b.colour.astype(np.float64) - a.colour
            whole.append(decibel(error))
            inside.append(decibel(error[1 - a.transmittance > 0.5]))
    np.testing.assert_allclose(measured.whole.ravel(), whole, rtol=1e-6)
    np.testing.assert_allclose(measured.inside.ravel(), inside, rtol=1e-6)
    assert measured.psnr == pytest.approx(np.mean(whole), rel=1e-6)
    assert measured.psnr_inside == pytest.approx(np.mean(inside), rel=1e-6)
    assert measured.worst_psnr == pytest.approx(min(whole), rel=1e-6)
    assert measured.worst_inside == pytest.approx(min(inside), rel=1e-6)


def test_the_background_of_training_plays_no_part(yardstick: Yardstick, source: Avatar) -> None:
    bright = replace(source, raster=replace(source.raster, background=(1.0, 1.0, 1.0)))
    assert (yardstick.measure(bright).whole == LARGEST_DB).all()


def test_the_largest_distance_of_posed_positions(source: Avatar, yardstick: Yardstick) -> None:
    measured = yardstick.measure(moved(source, 0.01))  # nothing scales the group `hair`
    assert measured.position_error is not None
    np.testing.assert_allclose(measured.position_error, 0.01, rtol=1e-5)


def test_an_avatar_of_fewer_gaussians_has_no_position_error(source: Avatar, yardstick: Yardstick) -> None:
    assert source.rig is not None
    fewer = subset(source, np.arange(0, source.gaussians.count, 2), source.rig.anchor_vertices).avatar
    measured = yardstick.measure(fewer)
    assert measured.position_error is None and measured.psnr < 60
    found = measured.as_json()
    assert found["position_error"] is None and "position_error" not in found["poses"][0]


def test_the_json_says_which_pose_is_worst(yardstick: Yardstick, source: Avatar) -> None:
    measured = yardstick.measure(moved(source, 0.01))
    errors = np.array([1e-3, 3e-3, 2e-3])
    found = replace(measured, position_error=errors).as_json()
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    assert found["position_error"] == {"metres": 3e-3, "pose": measured.poses[1]}
    assert found["psnr_db"] == {"mean": round(measured.psnr, 3), "worst": round(measured.worst_psnr, 3)}
    assert [row["name"] for row in found["poses"]] == list(measured.poses)
    assert found["poses"][2]["psnr_mask_db"] == [round(x, 3) for x in measured.inside[2].tolist()]
    assert found["views"] == ["front", "40 degrees left", "40 degrees right"]
    assert (found["size"], found["backend"], found["profile"]) == ([SIZE, SIZE], "reference", "trainer")


def test_no_figure_where_the_source_covers_nothing(source: Avatar, chosen: list[NamedPose]) -> None:
    clear = replace(
        source,
        gaussians=replace(source.gaussians, opacity_logit=source.gaussians.opacity_logit - 10),
    )
    measured = compare(clear, source, chosen[:1], views(source, SIZE, chosen)[:1], "reference")
    assert measured.psnr_inside is None and measured.worst_inside is None
    assert measured.as_json()["psnr_mask_db"] == {"mean": None, "worst": None}
    json.dumps(measured.as_json(), allow_nan=False)


def test_a_broken_avatar_gets_the_lowest_figure(source: Avatar, yardstick: Yardstick) -> None:
    mean = np.full_like(source.gaussians.mean, np.nan)
    assert distance(source.gaussians.mean, mean) == np.inf
    image = np.zeros((2, 2, 3), np.float32)
    assert psnr(image, np.ones((2, 2), bool), image + np.float32(np.nan)) == (-LARGEST_DB, -LARGEST_DB)
    found = replace(yardstick.measure(source), position_error=np.array([0.0, np.inf, 0.0])).as_json()
    assert found["position_error"] == {"metres": None, "pose": yardstick.poses[1].name}


def test_each_image_is_drawn_once(
    monkeypatch: pytest.MonkeyPatch, source: Avatar, chosen: list[NamedPose], cameras: list[NamedView]
) -> None:
    count = {"frame": 0, "animate": 0}
    for name in count:
        plain: Callable[..., Splats] = getattr(ReferenceBackend, name)

        def counted(
            self: ReferenceBackend, *args: Any, name: str = name, plain: Callable[..., Splats] = plain
        ) -> Splats:
            count[name] += 1
            return plain(self, *args)

        monkeypatch.setattr(ReferenceBackend, name, counted)
    yardstick = Yardstick(source, chosen, cameras, "reference")
    yardstick.measure(source)
    yardstick.measure(source)
    assert count["frame"] == 3 * len(chosen) * len(cameras)


def test_pairs_are_the_images_that_were_measured(yardstick: Yardstick, source: Avatar) -> None:
    other = moved(source, 0.01)
    measured = yardstick.measure(other)
    for pair in yardstick.pairs(other):
        found = psnr(pair.source, pair.mask, pair.other)
        assert found == (measured.whole[pair.pose, pair.view], measured.inside[pair.pose, pair.view])


def test_no_pose_or_view_is_refused(source: Avatar, chosen: list[NamedPose]) -> None:
    with pytest.raises(ValueError, match="one view"):
        Yardstick(source, chosen, [], "reference")
