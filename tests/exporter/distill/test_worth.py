"""Entries that are not worth their bytes: those that show least go, and others take over what they can."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from samples.dumps import random_poses, write_dumps

from avatar_export.distill.make import distill
from avatar_export.distill.residual import LARGER
from avatar_export.distill.worth import WORTH, lean
from avatar_runtime.avatar import Avatar, SparseRows
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import full_avatar
from tests.exporter.distill.conftest import bent


def dense(rows: SparseRows, name: str) -> np.ndarray:
    """[N, K, c] of an attribute."""
    values = rows.values[name]
    found = np.zeros((rows.rows, rows.columns, *values.shape[1:]))
    for row in range(rows.rows):
        for entry in range(rows.row_ptr[row], rows.row_ptr[row + 1]):
            found[row, rows.column[entry]] = values[entry]
    return found.reshape(*found.shape[:2], -1)


PATTERNS = (("geometry", ("mean", "quat_wxyz")), ("appearance", ("log_scale", "opacity_logit", "sh")))


@pytest.mark.parametrize("most", [0.0, 0.3, 1e9])
def test_what_stays_fits_best_what_all_did(most: float) -> None:
    """The oracle: least squares on the columns that stay, Gaussian by Gaussian."""
    avatar = full_avatar(3)
    rng = np.random.default_rng(1)
    weights = rng.uniform(0, 1, (40, len(avatar.expressions)))
    weights[:, 1] += 0.7 * weights[:, 0]  # so that one can take over a part of what the other did
    share = rng.uniform(0.5, 2, avatar.gaussians.count)
    found = lean(avatar, weights, share, most * everything(avatar, weights, share))
    gone = 0
    for part, names in PATTERNS:
        before, after = (getattr(one.blendshapes, part) for one in (avatar, found))
        gone += before.entries - after.entries
        for name in names:
            was, now = dense(before, name), dense(after, name)
            base = getattr(avatar.gaussians, name).reshape(len(was), -1)
            moved = getattr(found.gaussians, name).reshape(len(was), -1)
            for row in range(len(was)):
                stays = after.column[after.row_ptr[row] : after.row_ptr[row + 1]]
                columns = np.concatenate([np.ones((40, 1)), weights[:, stays]], axis=1)
                wanted = base[row] + weights @ was[row]
                best = columns @ np.linalg.lstsq(columns, wanted, rcond=None)[0]
                size = np.abs(was[row]).max() + 1e-9
                assert np.abs(moved[row] + weights @ now[row] - best).max() < 0.01 * size, (name, row)
    total = avatar.blendshapes.geometry.entries + avatar.blendshapes.appearance.entries
    assert gone == {0.0: 0, 1e9: total}.get(most, gone) and (most != 0.3 or 0.1 * total < gone < 0.9 * total)


def everything(avatar: Avatar, weights: np.ndarray, share: np.ndarray) -> float:
    """About what all entries show together."""
    total, power = 0.0, np.var(weights, axis=0)[:, None]
    for part, names in PATTERNS:
        for name in names:
            change = WORTH[name] * dense(getattr(avatar.blendshapes, part), name)
            total += float((share[:, None, None] * np.square(change) * power).sum())
    return total


def test_an_avatar_without_changes_of_colour_is_thinned_too() -> None:
    avatar = full_avatar(3)
    none = SparseRows.empty(
        avatar.gaussians.count,
        len(avatar.expressions),
        {"log_scale": (3,), "opacity_logit": (), "sh": (16, 3)},
    )
    still = replace(avatar, blendshapes=replace(avatar.blendshapes, appearance=none))
    weights = np.random.default_rng(1).uniform(0, 1, (40, len(avatar.expressions)))
    found = lean(still, weights, np.ones(avatar.gaussians.count), 1e9)
    assert found.blendshapes.geometry.entries == found.blendshapes.appearance.entries == 0


def test_what_is_not_linear_is_baked_into_clips_and_drivers_play_what_was_measured(
    small_head: Avatar, tmp_path: Path
) -> None:
    takes = [random_poses(small_head, 30, 4.0, active=3), random_poses(small_head, 6, 4.0, seed=8, active=3)]
    result = distill(write_dumps(small_head, takes, tmp_path / "dumps", change=bent), accept_error=True)
    assert result.form == "skinning with residual bases in the clips"
    avatar, shapes, n = result.avatar, result.avatar.blendshapes, small_head.gaussians.count
    first = avatar.expression_names.index("residual_00")
    assert result.baked is not None and result.baked.decibels > result.errors.decibels + 1
    assert np.abs(avatar.clips[0].expression_weights[:, first]).max() > 0.5
    assert result.reason.values["dropped"].startswith("skinning with")
    sizes = {"geometry": 2 + 4 * (3 + 4), "appearance": 2 + 4 * (3 + 1 + 3 * avatar.gaussians.sh.shape[1])}
    added = sum(size * int((getattr(shapes, part).column >= first).sum()) for part, size in sizes.items())
    others = sum(size * int((getattr(shapes, part).column < first).sum()) for part, size in sizes.items())
    others += 4 * n * (11 + 3 * avatar.gaussians.sh.shape[1])
    others += shapes.correctives.entries * (2 + 12) + avatar.skin.entries * (2 + 4)
    assert 0.5 * (LARGER - 1) * others < added <= (LARGER - 1) * others
    player = Player(avatar, "reference")
    truth = Player(small_head, "reference")
    off = []
    for pose in takes[1]:
        eyelids = {f"eyelid_{name}": weight for name, weight in pose.eyelids.items()}
        driven = player.animate(Pose({**pose.expressions, **eyelids}, pose.joints))
        off.append(np.square(driven.mean - bent(truth.animate(pose), pose).mean).sum(axis=1).mean())
    assert 1e3 * np.sqrt(np.mean(off)) == pytest.approx(result.errors.rms, rel=1e-3)
