"""The sample avatars as a person would judge them, in numbers: profiles agree, mouth and lids move, teeth follow."""

from __future__ import annotations

import numpy as np
import pytest
from samples.make import make_gaussian_blendshapes

from avatar_export.driving.matrix import with_driving
from avatar_export.images import arkit_pose
from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.measured import Measure
from tests.psnr import profile_psnr
from tests.shared_data import shared

SMILE = {"mouthSmileLeft": 0.8, "mouthSmileRight": 0.8, "jawOpen": 0.3}


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> Avatar:
    """The demo's head, a quarter of its size."""
    base = make_gaussian_blendshapes(tmp_path_factory.mktemp("head"), 5000)
    return with_driving(read(base / "model", ReadOptions(dataset=base)), base / "driving.json")


@pytest.mark.parametrize("name", ["head", "blendshapes_avatar", "lam_avatar"])
def test_engine_meets_trainer(name: str, request: pytest.FixtureRequest, measured: Measure) -> None:
    avatar: Avatar = request.getfixturevalue(name)
    pose = Pose() if avatar.driving.mode == "none" else arkit_pose(avatar, SMILE)
    for yaw in (0.0, 0.7):
        agreement = profile_psnr(avatar, pose, 256, yaw)
        measured(f"engine against trainer profile, {name}, dB", agreement, 65)
        assert agreement >= 65


def test_a_real_lam_avatar_agrees_too() -> None:
    avatar = read(shared("lam/p2-1.zip"))
    assert profile_psnr(avatar, arkit_pose(avatar, SMILE), 256) >= 65


def test_lower_teeth_follow_the_jaw_and_upper_teeth_stay(head: Avatar) -> None:
    player = Player(head)
    rest, opened = player.animate(Pose()).mean, player.animate(arkit_pose(head, {"jawOpen": 1.0})).mean
    moved = {g.name: (opened - rest)[g.first : g.first + g.count] for g in head.groups}
    assert np.abs(moved["upper_teeth"]).max() < 1e-3
    down = moved["lower_teeth"][:, 1]
    assert down.max() < 0  # those beside the joint move least
    assert np.median(down) < -0.01


def test_every_arkit_shape_moves_something(head: Avatar) -> None:
    player = Player(head)
    rest = player.animate(Pose()).mean
    for name in head.driving.inputs:
        moved = np.abs(player.animate(arkit_pose(head, {name: 1.0})).mean - rest).max()
        assert 5e-4 < moved < 0.05, name
