"""The sample avatars in numbers: the profiles agree."""

from __future__ import annotations

import pytest
from samples.make import make_gaussian_blendshapes

from avatar_export.driving.matrix import with_driving
from avatar_export.images import arkit_pose
from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from avatar_runtime.pose import Pose
from tests.measured import Measure
from tests.psnr import profile_psnr

SMILE = {"mouthSmileLeft": 0.8, "mouthSmileRight": 0.8, "jawOpen": 0.3}


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> Avatar:
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
