"""Cameras that an avatar is measured through: where they stand, and that they show every pose."""

from __future__ import annotations

import numpy as np

from avatar_export.measure.poses import NamedPose, poses
from avatar_export.measure.views import views
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous
from tests.avatars import full_avatar


def test_front_and_forty_degrees_to_each_side() -> None:
    found = views(full_avatar(), 64)
    target = np.mean([np.linalg.inv(v.camera.camera_from_world)[:3, 3] for v in found[1:]], axis=0)
    forward = [v.camera.camera_from_world[2, :3] for v in found]
    yaw = [np.degrees(np.arctan2(-f[0], -f[2])) for f in forward]
    np.testing.assert_allclose(yaw, [0, 40, -40], atol=1e-4)
    np.testing.assert_allclose([f[1] for f in forward], 0, atol=1e-6)
    assert target[2] < np.linalg.inv(found[0].camera.camera_from_world)[2, 3]
    assert {(v.camera.width, v.camera.height) for v in found} == {(64, 64)}


def test_every_pose_lies_in_the_image() -> None:
    avatar = full_avatar()
    far = NamedPose("far", Pose(world_from_avatar=homogeneous(np.eye(3), np.array([0.5, 0.0, 0.0]))))
    shown = [*poses(avatar), far]
    player = Player(avatar, "reference")
    for view in views(avatar, 64, shown):
        for named in shown:
            mean = player.animate(named.pose).mean
            clip = np.c_[mean, np.ones(len(mean))] @ view.camera.clip_from_world.T
            assert np.abs(clip[:, :2] / clip[:, 3:]).max() < 1, named.name


def test_poses_default_to_those_of_the_avatar() -> None:
    avatar = full_avatar()
    for a, b in zip(views(avatar, 32), views(avatar, 32, poses(avatar)), strict=True):
        np.testing.assert_array_equal(a.camera.clip_from_world, b.camera.clip_from_world)
