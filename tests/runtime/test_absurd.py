"""Finite numbers that overflow on the way: such a bundle loads, and every backend plays it without an exception."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_runtime.camera import Camera
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import full_avatar

CAMERA = Camera.orbit(np.zeros(3), 2.0, 0.0, 0.0, 0.5, 16, 16)
ANCHORED = slice(24, 32)  # Gaussians that follow the anchor vertices


@pytest.fixture(params=["reference", "cpu"])
def backend(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_a_joint_far_beyond_float32_plays(backend: str) -> None:
    player = Player(full_avatar(), backend)
    pose = Pose(joints={"neck": np.diag([1e200, 1e200, 1e200, 1.0])})
    splats = player.animate(pose)
    assert not np.isfinite(splats.mean[ANCHORED]).any()
    assert np.isfinite(player.frame(pose, CAMERA).image.colour).all()


def test_a_rest_pose_without_an_inverse_is_refused() -> None:
    """Each transform has one; their product underflows, so nothing could be posed."""
    rig = full_avatar().rig
    assert rig is not None
    many = 60
    rest = np.tile(np.diag([1e-5, 1e-5, 1e-5, 1]).astype(np.float32), (many, 1, 1))
    chain = replace(
        rig,
        joint_names=(*rig.joint_names, *(f"j{i}" for i in range(many - rig.joint_count))),
        parents=np.arange(-1, many - 1, dtype=np.int32),
        rest_local=rest,
        inverse_bind_matrix=rest,
        joint_basis=np.zeros((4, many, 3), np.float32),
        skin=replace(rig.skin, columns=many),
        corrective_joints=rig.corrective_joints,
    )
    avatar = replace(full_avatar(), rig=chain)
    avatar = replace(avatar, skin=replace(avatar.skin, columns=many), clips=())
    with pytest.raises(
        AvatarError, match=r"^rig.rest_local: joint j\d+ and its parents together have no inverse"
    ):
        check_avatar(avatar)
