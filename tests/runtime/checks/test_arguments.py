"""What a caller passes by mistake: every public function answers with a TypeError or ValueError that names it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avatar_runtime import (
    Avatar,
    Camera,
    Driver,
    DrivingFrame,
    Player,
    Pose,
    check_avatar,
    clip_pose,
    engine_clip,
    engine_pose,
    joint_rotation,
    load,
    target_names,
)
from avatar_runtime.clips import frame_pose
from tests.avatars import full_avatar

AVATAR = full_avatar()
CLIP = AVATAR.clips[0]
PLAYER = Player(AVATAR, "reference")
CAMERA = Camera.orbit(np.zeros(3), 2.0, 0.0, 0.0, 0.5, 8, 8)
DRIVER = Driver(AVATAR)
NONE: Any = None
GL_PROJECTION = np.array([[1.0, 0, 0, 0], [0, 2, 0, 0], [0, 0, -1, -0.2], [0, 0, -1, 0]])
K = np.array([[9.0, 0, 4], [0, 9, 4], [0, 0, 1]])


def opencv(**given: Any) -> Camera:
    values: dict[str, Any] = {"rotation": np.eye(3), "translation": np.zeros(3), "intrinsics": K}
    return Camera.from_opencv(**{**values, "width": 8, "height": 8, **given})


def orbit(**given: Any) -> Camera:
    values: dict[str, Any] = {"target": np.zeros(3), "distance": 1.0, "yaw": 0.0, "pitch": 0.0, "fov_y": 0.5}
    return Camera.orbit(**{**values, "width": 8, "height": 8, **given})


def opengl(**given: Any) -> Camera:
    return Camera.from_opengl(
        **{"view": np.eye(4), "projection": GL_PROJECTION, "width": 8, "height": 8, **given}
    )


def weight(value: Any) -> object:
    return PLAYER.animate(Pose({"jawOpen": value}))


def joint(value: Any) -> object:
    return PLAYER.animate(Pose(joints={"jaw": value}))


def frame(*arguments: Any, **named: Any) -> object:
    return PLAYER.frame(*arguments, **named)


def driven(**given: Any) -> Pose:
    return DRIVER.pose(replace(DrivingFrame(0.0, {}), **given))


def with_rig(**given: Any) -> Avatar:
    assert AVATAR.rig is not None
    return check_avatar(replace(AVATAR, rig=replace(AVATAR.rig, **given)))


MISTAKES: tuple[tuple[Callable[[], object], type[Exception], str], ...] = (
    (lambda: weight("much"), TypeError, "expression jawOpen is the text 'much'; a number is needed"),
    (lambda: weight(10**400), ValueError, "expression jawOpen is too large for a float"),
    (lambda: joint(np.eye(3)), ValueError, "joint jaw has shape [3, 3]; [4, 4] is needed"),
    (lambda: joint([[1], [2, 3]]), TypeError, "joint jaw is a list; an array [4, 4] is needed"),
    (lambda: PLAYER.animate(Pose([1, 2])), TypeError, "pose.expressions is a list; a mapping by name"),
    (lambda: frame(None, CAMERA), TypeError, "pose is None; a Pose is needed"),
    (lambda: frame(Pose(), None), TypeError, "camera is None; a Camera is needed"),
    (lambda: frame(Pose(), CAMERA, (0, 0, np.nan)), ValueError, "background holds a number that is not finite"),
    (lambda: frame(Pose(), CAMERA, (0, 0)), ValueError, "background has shape [2]; [3] is needed"),
    (lambda: frame(Pose(), CAMERA, None, "fast"), ValueError, "profile: 'fast' is not one of trainer, engine"),
    (lambda: PLAYER.animate(Pose(), 3), TypeError, "milliseconds is an int; a dict is needed"),
    (lambda: Player("head.avatar"), TypeError, "avatar is the text 'head.avatar'; an Avatar, which load(path)"),
    (lambda: Player(AVATAR, "gpu"), ValueError, "backend: 'gpu' is not one of reference, cpu, gl"),
    (lambda: Player(AVATAR, "cpu", es=True), ValueError, "es is an option of backend gl, not of cpu"),
    (lambda: Player(AVATAR, "reference", threads=2), ValueError, "threads is an option of backend cpu, not of ref"),
    (lambda: Player(AVATAR, level=0.5), TypeError, "level is a float; a whole number is needed"),
    (lambda: opencv(intrinsics=K.T), ValueError, "intrinsics are not [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]"),
    (lambda: opencv(intrinsics=np.diag([-9.0, 9, 1])), ValueError, "intrinsics: the focal lengths are -9 and 9"),
    (lambda: opencv(rotation=2 * np.eye(3)), ValueError, "rotation is not a rotation matrix: an entry of R R^T - I"),
    (lambda: opencv(rotation=-np.eye(3)), ValueError, "rotation is not a rotation matrix: its determinant is -1"),
    (lambda: opencv(translation=[0, 0, np.inf]), ValueError, "translation holds a number that is not finite"),
    (lambda: opencv(width=8.0), TypeError, "width is a float; a whole number is needed"),
    (lambda: orbit(yaw=np.nan), ValueError, "yaw is nan; a finite number is needed"),
    (lambda: orbit(fov_y=20), ValueError, "fov_y is 20 radians; more than 0 and less than pi is needed"),
    (lambda: opengl(projection=np.eye(4)), ValueError, "projection has no perspective; an orthographic camera"),
    (lambda: opengl(projection=GL_PROJECTION + np.diag([0, 0, 0, 1.0])), ValueError, "projection has no perspective"),
    (lambda: opengl(projection=np.diag([1, -1, 1, 1.0]) @ GL_PROJECTION), ValueError, "projection mirrors the image"),
    (lambda: opengl(view=np.diag([0, 1, 1, 1.0])), ValueError, "view has no inverse"),
    (lambda: opengl(view=np.eye(4) * 1e300), ValueError, "view has no inverse, or the camera holds a number beyond"),
    (lambda: opengl(width=0), ValueError, "width is 0; 1 to 32768 is needed"),
    (lambda: replace(CAMERA, centre=np.zeros(2)), ValueError, "centre has shape [2]; [3] is needed"),
    (lambda: clip_pose(AVATAR, CLIP, np.nan), ValueError, "seconds is nan; a finite number is needed"),
    (lambda: frame_pose(AVATAR, CLIP, CLIP.frames), ValueError, f"frame is {CLIP.frames}; 0 to {CLIP.frames - 1}"),
    (lambda: clip_pose(AVATAR, NONE, 0), TypeError, "clip is None; a Clip is needed"),
    (
        lambda: engine_clip(AVATAR, replace(CLIP, joint_delta=CLIP.joint_delta[:, 1:])),
        ValueError,
        "clip 'nod' has 4 expressions, 2 eyelids and 4 joints, the avatar 4, 2 and 5: it is another avatar's",
    ),
    (lambda: engine_pose(AVATAR, NONE), TypeError, "pose is None; a Pose is needed"),
    (lambda: target_names(NONE), TypeError, "avatar is None; an Avatar is needed"),
    (lambda: joint_rotation("xyz"), TypeError, "rotvec is the text 'xyz'; three numbers is needed"),
    (lambda: joint_rotation([1.0, 2.0, np.nan]), ValueError, "rotvec holds a number that is not finite"),
    (lambda: load(NONE), TypeError, "path is None; a path is needed"),
    (lambda: DRIVER.pose({"jawOpen": 1.0}), TypeError, "frame is a dict; a DrivingFrame is needed"),
    (lambda: driven(weights=[0.5]), TypeError, "frame.weights is a list; a mapping by name is needed"),
    (lambda: driven(weights={"jawOpen": np.nan}), ValueError, "frame.weights jawOpen is nan; a finite number"),
    (lambda: driven(weights={"JawOpne": 1.0}), ValueError, "frame.weights: 'JawOpne' is neither an ARKit name"),
    (lambda: driven(head=(0.0, 0.0)), ValueError, "frame.head has shape [2]; [3] is needed"),
    (lambda: check_avatar(NONE), TypeError, "avatar is None; an Avatar is needed"),
    (lambda: check_avatar(replace(AVATAR, groups=NONE)), TypeError, "groups is None; a tuple is needed"),
    (lambda: with_rig(vertices=[[0.0, 0, 0]]), TypeError, "rig.vertices is a list; a NumPy array is needed"),
)  # fmt: skip


@pytest.mark.parametrize(
    ("call", "kind", "message"), MISTAKES, ids=[message[:40] for _, _, message in MISTAKES]
)
def test_a_mistake_names_the_argument(
    call: Callable[[], object], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match="^" + re.escape(message)):
        call()
