"""The pose of a clip at a time: exact in frames, between them interpolated, at the ends held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_runtime.avatar import Avatar, Clip
from avatar_runtime.clips import clip_pose, frame_pose
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import PoseArrays, resolve
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.avatars import full_avatar
from tests.golden import Array

AVATAR = full_avatar()
FPS = 25.0
RNG = np.random.default_rng(8)
SHEAR = np.triu(RNG.normal(0, 0.2, (2, 5, 3, 3))) + np.eye(3)
AXIS = np.array([0.6, -0.8, 0.0])
ANGLE = np.array([0.3, 1.7])  # of the joints in both frames, about AXIS
WORLD = np.array([-1.5, -1.7])  # of the avatar, about z; quat_from_matrix gives these opposite signs


def two_frames() -> Clip:
    turn = matrix_from_rotvec(ANGLE[:, None] * AXIS)[:, None]
    delta = homogeneous(turn @ SHEAR, RNG.normal(0, 0.1, (2, 5, 3)))
    world = homogeneous(matrix_from_rotvec(WORLD[:, None] * [0, 0, 1.0]), RNG.normal(0, 1, (2, 3)))
    weights = RNG.uniform(0, 1, (2, 4)), RNG.uniform(0, 1, (2, 2))
    return Clip("two", FPS, *(part.astype(np.float32) for part in (*weights, delta, world)))


CLIP = two_frames()


def at(seconds: float, clip: Clip = CLIP, avatar: Avatar = AVATAR) -> PoseArrays:
    return resolve(clip_pose(avatar, clip, seconds), avatar)


def same(a: PoseArrays, b: PoseArrays) -> bool:
    return all(np.array_equal(x, y) for x, y in zip(vars(a).values(), vars(b).values(), strict=True))


def test_a_clip_lasts_from_its_first_frame_to_its_last() -> None:
    assert CLIP.seconds == 1 / FPS and replace(CLIP, fps=10.0).seconds == 0.1


def test_frames_are_exact_and_ends_hold() -> None:
    clip = AVATAR.clips[0]
    frames = [resolve(frame_pose(AVATAR, clip, k), AVATAR) for k in range(clip.frames)]
    for k, want in enumerate(frames):
        assert all(same(at((k + off) / clip.fps, clip), want) for off in (-4e-7, 0, 4e-7))
    assert same(at(-1, clip), frames[0]) and same(at(1e9, clip), frames[-1])
    assert not same(at(0.5 / clip.fps, clip), frames[0])


def between(angles: Array, part: float) -> float:
    """Of two quaternions about one axis, mixed and made unit."""
    half = (1 - part) * np.exp(0.5j * angles[0]) + part * np.exp(0.5j * angles[1])
    return 2 * float(np.angle(half))


@pytest.mark.parametrize("part", [0.25, 0.5, 0.8])
def test_between_frames_turns_and_what_remains_are_mixed(part: float) -> None:
    got, (first, second) = at(part / FPS), (at(0), at(1 / FPS))
    for name in ("expression_weights", "late_weights"):
        mixed = (1 - part) * getattr(first, name) + part * getattr(second, name)
        np.testing.assert_allclose(getattr(got, name), mixed, rtol=0, atol=1e-7)
    turn = matrix_from_rotvec(between(ANGLE, part) * AXIS)
    rest = (1 - part) * SHEAR[0] + part * SHEAR[1]
    np.testing.assert_allclose(got.joint_delta[:, :3, :3], turn @ rest, atol=1e-6)
    moved = (1 - part) * first.joint_delta[:, :3, 3] + part * second.joint_delta[:, :3, 3]
    np.testing.assert_allclose(got.joint_delta[:, :3, 3], moved, atol=1e-9)
    placed = matrix_from_rotvec(between(WORLD, part) * np.array([0, 0, 1.0]))
    np.testing.assert_allclose(got.world_from_avatar[:3, :3], placed, atol=1e-6)


def test_equal_frames_and_mirrors_keep_their_numbers() -> None:
    still = np.diag([1.0, -0.3, 0.2, 1.0]).astype(np.float32)
    mirror: Array = np.tile(still, (2, 5, 1, 1))
    np.testing.assert_array_equal(at(0.4 / FPS, replace(CLIP, joint_delta=mirror)).joint_delta, mirror[0])
    turned = np.repeat(CLIP.joint_delta[:1], 2, axis=0)
    np.testing.assert_array_equal(at(0.4 / FPS, replace(CLIP, joint_delta=turned)).joint_delta, turned[0])
    mirror[1, :, 0, 0] = 3
    np.testing.assert_allclose(
        at(0.5 / FPS, replace(CLIP, joint_delta=mirror)).joint_delta[0], np.diag([2, -0.3, 0.2, 1]), atol=1e-7
    )


def test_a_joint_of_no_size_has_no_rotation_between_frames() -> None:
    flat = CLIP.joint_delta.copy()
    flat[1, 2, :3, :3] = 0
    with pytest.raises(AvatarError, match="expected a finite 4x4 matrix"):
        at(0.5 / FPS, replace(CLIP, joint_delta=flat))


def test_an_avatar_without_a_rig_has_clips() -> None:
    avatar = replace(AVATAR, rig=None)
    clip = replace(CLIP, joint_delta=CLIP.joint_delta[:, :0])
    assert at(0.5 / FPS, clip, avatar).joint_delta.shape == (0, 4, 4)
