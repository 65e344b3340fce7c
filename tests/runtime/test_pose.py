"""Poses by name, and what a wrong name or number gets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose, joint_rotation, resolve
from tests.avatars import full_avatar
from tests.golden import Array

TURN = joint_rotation([0.3, -0.2, 0.1])


@pytest.fixture
def avatar() -> Avatar:
    return full_avatar()


def test_an_alias_is_its_expression(avatar: Avatar) -> None:
    for alias in ("JawOpen", "jaw_open"):
        weights = resolve(Pose({alias: 0.5}), avatar).expression_weights
        np.testing.assert_array_equal(weights, [0.5, 0, 0, 0])


def test_a_name_and_its_alias_together_are_refused(avatar: Avatar) -> None:
    with pytest.raises(AvatarError, match="jawOpen: is given twice"):
        resolve(Pose({"JawOpen": 0.5, "jawOpen": 0.25}), avatar)


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        (Pose({"jawOpne": 1}), ["'jawOpne'", "expression", "did you mean jawOpen?"]),
        (Pose({"MOUTHSMILELEFT": 1}), ["did you mean mouthSmileLeft"]),
        (Pose({"zzz": 1}), ["'zzz'", "there are 4: jawOpen, mouthSmileLeft, mouthSmileRight, exp_003"]),
        (Pose(eyelids={"lefft": 1}), ["eyelid", "did you mean left?"]),
        (Pose(joints={"jav": TURN}), ["joint", "did you mean jaw?"]),
    ],
)
def test_an_unknown_name_gets_near_matches(avatar: Avatar, pose: Pose, words: list[str]) -> None:
    with pytest.raises(AvatarError) as error:
        resolve(pose, avatar)
    assert "\n" not in str(error.value)
    for word in words:
        assert word in str(error.value)


def test_an_avatar_without_a_rig_has_no_joints(avatar: Avatar) -> None:
    with pytest.raises(AvatarError, match="is not a joint of this avatar; there are 0"):
        resolve(Pose(joints={"jaw": TURN}), replace(avatar, rig=None))
    assert resolve(Pose(), replace(avatar, rig=None)).joint_delta.shape == (0, 4, 4)


@pytest.mark.parametrize("weight", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("part", ["expressions", "eyelids"])
def test_bad_weight(avatar: Avatar, part: str, weight: float) -> None:
    """1e300 is finite, but not as the float32 that the stages take."""
    name = {"expressions": "jawOpen", "eyelids": "left"}[part]
    with pytest.raises(AvatarError, match=f"{name}: .*finite"):
        resolve(Pose(**{part: {name: weight}}), avatar)


NAN = np.full((4, 4), np.nan)
MOVED = np.eye(4)
MOVED[0, 3] = 0.5


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (NAN, "expected a finite 4x4 matrix"),
        (MOVED.T, r"last row is \[0\.5, 0\.0, 0\.0, 1\.0\], not .*last column"),
    ],
)
def test_bad_matrix(avatar: Avatar, matrix: Array, message: str) -> None:
    with pytest.raises(AvatarError, match=f"joint jaw: .*{message}"):
        resolve(Pose(joints={"jaw": matrix}), avatar)
    with pytest.raises(AvatarError, match=f"world_from_avatar: .*{message}"):
        resolve(Pose(world_from_avatar=matrix), avatar)
