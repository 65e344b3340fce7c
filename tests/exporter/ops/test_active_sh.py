"""Coefficients beyond the active SH degree go, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from avatar_export.images import frame_camera, robust_box
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.writers.reference_cases import every_input
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.player import Player
from tests.avatars import full_avatar


def test_it_plays_as_before_with_fewer_coefficients() -> None:
    stored = replace(full_avatar(2), sh_degree=1)
    assert stored.gaussians.sh.shape[1] == 16
    cut = check_avatar(with_active_sh(stored))
    assert cut.gaussians.sh.shape[1] == cut.blendshapes.appearance.values["sh"].shape[1] == 4
    assert np.array_equal(cut.gaussians.sh, stored.gaussians.sh[:, :4])
    pose = every_input(stored)
    camera = frame_camera(robust_box(stored.gaussians.mean), 48, 48)
    before, after = (Player(a, "reference").frame(pose, camera).image for a in (stored, cut))
    assert np.array_equal(before.colour, after.colour)
    assert not np.array_equal(
        before.colour, Player(full_avatar(2), "reference").frame(pose, camera).image.colour
    )


def test_what_is_all_active_stays() -> None:
    avatar = replace(full_avatar(2), sh_degree=3)
    assert with_active_sh(avatar) is avatar
