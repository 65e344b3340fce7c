"""Coarser levels: sound, repeatable, alike; merging and embedding keep what they promise."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bench.levels import judging_views, psnr_db

from avatar_export.levels import coarser
from avatar_export.levels.compositing import Flat, contribution, error_shares, squared_error
from avatar_export.levels.embed import embedded
from avatar_export.levels.level import largest_contribution
from avatar_export.levels.merge import merged, merging
from avatar_export.levels.mixing import unit
from avatar_export.levels.views import flattened
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.player import Player
from avatar_runtime.subset import subset
from tests.avatars import assert_same

TRAINED = Path(__file__).parents[3] / "samples" / "trained"


@cache
def trained(name: str) -> Avatar:
    return load(TRAINED / name)


@cache
def body_level() -> Avatar:
    return coarser(trained("body_splatting"), 0.5, steps=12)


def test_a_level_is_a_sound_avatar_that_looks_like_its_source() -> None:
    source, level = trained("body_splatting"), check_avatar(body_level())
    assert level.gaussians.count == 6000
    assert level.clips == source.clips and level.rig is source.rig and level.rules == source.rules
    found = psnr_db(source, level, judging_views(source, 128)[::6])
    assert np.mean(found) > 29 and min(found) > 26, found


def test_a_group_keeps_its_name_and_place_and_is_never_empty() -> None:
    whole = trained("head_blendshapes")
    source = _rows(whole, np.arange(0, whole.gaussians.count, 20))
    level = check_avatar(coarser(source, 0.05, steps=1))
    assert [group.name for group in level.groups] == [group.name for group in source.groups]
    assert all(group.count > 0 for group in level.groups)
    assert level.gaussians.count == round(0.05 * source.gaussians.count)


def test_the_same_avatar_gives_the_same_level() -> None:
    rows = np.arange(0, 600)
    small = _rows(trained("body_splatting"), rows)
    assert_same(coarser(small, 0.5, steps=2), coarser(small, 0.5, steps=2))
    assert coarser(small, 1.0) is small


def test_what_one_view_alone_shows_counts_as_much_as_what_all_show(monkeypatch: pytest.MonkeyPatch) -> None:
    source = _rows(trained("body_splatting"), np.arange(0, 12000, 40))
    front, left, right = judging_views(source, 512)[:3]
    found = []
    for seen in ([front], [left], [right], [front, front, front, left, right]):
        monkeypatch.setattr("avatar_export.levels.level.views", lambda *_, seen=seen, **__: seen)
        found.append(largest_contribution(source))
    np.testing.assert_allclose(found[3], np.max(found[:3], axis=0), rtol=1e-6)
    assert (found[0] != found[1]).any()


@pytest.mark.parametrize("keep", [0.0, -1.0, 1.5, float("nan")])
def test_an_impossible_share_is_refused(keep: float) -> None:
    with pytest.raises(ValueError, match="keep"):
        coarser(trained("body_splatting"), keep)


@pytest.mark.parametrize("name", ["head_blendshapes", "head_points"])
def test_merging_each_gaussian_with_itself_changes_no_picture(name: str) -> None:
    source = trained(name)
    count = source.gaussians.count
    same = merged(source, merging(np.arange(count), np.arange(count), np.ones(count), count))
    assert min(psnr_db(source, same, judging_views(source, 128)[::8])) > 55


def test_embedding_again_gives_the_wanted_means_on_the_same_triangles() -> None:
    source = trained("head_points")
    g, embedding = source.gaussians, source.embedding
    assert embedding is not None
    again = embedded(
        embedding, source.rules, source.training_per_bundle, g.mean.astype(np.float64), unit(g.quat_wxyz)
    )
    assert np.array_equal(again.triangle, embedding.triangle)
    np.testing.assert_allclose(again.displacement, embedding.displacement, atol=1e-6)


def test_contributions_are_what_the_image_covers() -> None:
    source = trained("body_splatting")
    view = judging_views(source, 128)[1]
    player = Player(source)
    flat = flattened(source, player.animate(view.pose), view.camera)
    left = player.frame(view.pose, view.camera, (0.0, 0.0, 0.0)).image.transmittance
    assert contribution(flat, 128, 128).sum() == pytest.approx((1 - left).sum(), rel=1e-3)


def test_the_gradient_is_that_of_the_squared_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avatar_export.levels.compositing.LARGEST_ERROR", 10.0)
    rng = np.random.default_rng(2)
    flat = Flat(
        np.arange(5),
        rng.uniform(4, 12, (5, 2)).astype(np.float32),
        np.tile(np.array([0.05, 0.01, 0.04], np.float32), (5, 1)),
        rng.uniform(0.3, 0.8, 5).astype(np.float32),
        rng.uniform(0.4, 0.5, (5, 3)).astype(np.float32),
    )
    left = np.full((16, 16), 0.45, np.float32)
    target = np.full((16, 16, 3), 0.3, np.float32)
    gradient = squared_error(flat, target, left)[1]
    for name in ("centre", "conic", "opacity", "rgb"):
        value = getattr(flat, name)
        step = 1e-3 * np.abs(value) * rng.uniform(0.5, 1, value.shape)
        ends = [
            squared_error(replace(flat, **{name: (value + sign * step).astype(np.float32)}), target, left)[0]
            for sign in (1, -1)
        ]
        expected = float(np.sum(getattr(gradient, name) * 2 * step))
        assert ends[0] - ends[1] == pytest.approx(expected, rel=0.15, abs=2e-4), name


def test_gaussians_stay_apart_where_a_trial_looked_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    source = _rows(trained("body_splatting"), np.arange(0, 12000, 20))
    top = float(np.median(source.gaussians.mean[:, 1]))

    def above(level: Avatar) -> int:
        return int(np.count_nonzero(level.gaussians.mean[:, 1] > top))

    counts = []
    for wrong in (1.0, 1e-3):  # errors above the middle, against 1 below it
        monkeypatch.setattr(
            "avatar_export.levels.level.largest_error",
            lambda _, level, wrong=wrong: np.where(level.gaussians.mean[:, 1] > top, wrong, 1e-3 / wrong),
        )
        counts.append(above(coarser(source, 0.4, steps=1)))
    assert counts[0] > 1.2 * counts[1], counts


def test_shares_of_the_error_add_up_to_what_the_image_lacks() -> None:
    source = trained("body_splatting")
    view = judging_views(source, 128)[1]
    player = Player(source)
    flat = flattened(source, player.animate(view.pose), view.camera)
    image = player.frame(view.pose, view.camera, (0.0, 0.0, 0.0)).image
    target = image.colour.copy()
    target[40:60, 50:70] += 0.1
    wrong = np.zeros((128, 128))
    wrong[40:60, 50:70] = 3 * 0.1**2
    wrong *= (1 - image.transmittance) * (image.transmittance <= 0.5)
    shares = error_shares(flat, target, image.transmittance)
    assert shares.sum() == pytest.approx(wrong.sum(), rel=0.02)
    x, y = flat.centre.T
    near = (x > 45) & (x < 75) & (y > 35) & (y < 65)
    assert shares[near].sum() > 0.9 * shares.sum() > 0


def _rows(avatar: Avatar, rows: np.ndarray) -> Avatar:
    return subset(avatar, rows, np.arange(len(avatar.rig.vertices) if avatar.rig else 0)).avatar
