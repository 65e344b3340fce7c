"""Coarser levels: sound, alike, and left out where nobody would see them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from bench.levels import judging_views, psnr_db

from avatar_export.levels import coarser, heights_px, served
from avatar_export.levels.compositing import Flat, squared_error
from avatar_export.levels.judging import judged_poses
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.subset import subset

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


def _rows(avatar: Avatar, rows: np.ndarray) -> Avatar:
    return subset(avatar, rows, np.arange(len(avatar.rig.vertices) if avatar.rig else 0)).avatar


def joint_at(avatar: Avatar, name: str) -> np.ndarray:
    """[3] where a joint rests, mesh space."""
    assert avatar.rig is not None
    return np.linalg.inv(avatar.rig.inverse_bind_matrix[avatar.rig.joint_names.index(name)])[:3, 3]


def test_a_level_with_one_smeared_eye_serves_fewer_heights_than_one_without(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("avatar_export.levels.height.OCTAVES", 2)
    monkeypatch.setattr("avatar_export.levels.height.judged_poses", lambda avatar: judged_poses(avatar)[:3])
    source = trained("head_blendshapes")
    at = np.linalg.norm(source.gaussians.mean - joint_at(source, "leftEye"), axis=1)
    sh = source.gaussians.sh.copy()
    sh[at < 0.02, 0] = sh[at < 0.02, 0].mean(axis=0)
    smeared = replace(source, gaussians=replace(source.gaussians, sh=sh))
    whole, less = heights_px(source, [source, smeared])
    assert whole == 256 and less < 200


def test_levels_that_nobody_would_see_are_left_out_and_said(monkeypatch: pytest.MonkeyPatch) -> None:
    source = trained("body_splatting")
    levels = [subset(source, np.arange(n), np.arange(0)).avatar for n in (600, 500, 400, 300, 200)]
    found: list[int] = []
    monkeypatch.setattr("avatar_export.levels.height.heights_px", lambda _, coarse: found[: len(coarse)])
    found[:] = [300, 128, 128, 64]
    kept = served(levels)
    assert kept.kept == (0, 1, 3) and kept.heights == (None, 300, 128)
    assert ["400" in str(kept.notes[0]), "200" in str(kept.notes[1])] == [True, True]
    found[:] = [90, 100, 0, 0]
    assert served(levels).kept == (0, 2)
    found[:] = [0, 0, 0, 0]
    assert served(levels).kept == (0,) and len(served(levels).notes) == 4
    assert served(levels[:1]).notes == ()
