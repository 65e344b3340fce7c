"""Idle life by Python and by the C interface, held to the vectors of all players; Node and mono have own tests."""

from __future__ import annotations

import ctypes as C
import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avatar_runtime import idle
from avatar_runtime.avatar import Driving
from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS
from avatar_runtime.driving.driver import Driver
from avatar_runtime.pose import Pose
from tests.avatars import full_avatar
from tests.conformance.idle_vectors import FILE, frame, made
from tests.players.unreal.sources import library

VECTORS: list[dict[str, Any]] = json.loads(FILE.read_text("utf-8"))
DIGITS = 1e-11  # that the vectors have
FLOAT32 = 1e-7  # weights of the players


class Frame(C.Structure):
    """AvatarFrame."""

    _fields_ = (
        ("struct_size", C.c_uint32),
        ("weights", C.c_float * 52),
        ("angles", C.c_double * 9),
    )


def wanted(case: dict[str, Any]) -> list[float]:
    return [case["channels"].get(name, 0.0) for name in CHANNELS]


def test_the_vectors_are_those_of_their_formula() -> None:
    assert made() == VECTORS


@pytest.mark.parametrize("case", VECTORS, ids=lambda case: f"{case['seed']}_{case['seconds']:g}")
def test_python(case: dict[str, Any]) -> None:
    found = idle(case["seconds"], case["seed"])
    assert found.time == case["seconds"] and tuple(found.weights) == ARKIT_NAMES
    channels = [*found.weights.values(), *found.head, *found.left_eye, *found.right_eye]
    np.testing.assert_allclose(channels, wanted(case), rtol=0, atol=DIGITS)
    assert idle(case["seconds"], case["seed"] - 2**32) == found


def test_the_c_interface() -> None:
    native, into = C.CDLL(str(library())), Frame(struct_size=C.sizeof(Frame))
    for case in VECTORS:
        assert native.avatar_idle(C.c_double(case["seconds"]), C.c_uint32(case["seed"]), C.byref(into))
        want = wanted(case)
        np.testing.assert_allclose(into.weights, want[:52], rtol=0, atol=FLOAT32)
        np.testing.assert_allclose(into.angles, want[52:], rtol=0, atol=DIGITS)
    for seconds in (math.nan, math.inf, 1e16):
        assert not native.avatar_idle(C.c_double(seconds), C.c_uint32(1), C.byref(into))


def test_what_is_no_time_is_refused() -> None:
    for seconds in (math.nan, math.inf):
        with pytest.raises(ValueError, match="seconds"):
            idle(seconds)
    part: Any = 1.5
    with pytest.raises(TypeError, match="seed"):
        idle(1.0, part)


def test_eyes_and_head_aim_where_the_glance_goes() -> None:
    """+X is the subject's left, +Y up, the face looks along +Z. The eyes in the head, turned with it, look there."""
    driving = Driving("names", head_joint="neck", left_eye_joint="leftEye", right_eye_joint="rightEye")
    avatar = replace(full_avatar(3), driving=driving)
    farthest = np.zeros(2)
    for seconds in np.arange(0, 20, 0.7):
        pose, channels = Driver(avatar).pose(idle(seconds, 5)), frame(seconds, 5)
        aim = [channels[f"head{angle}"] - channels[f"leftEye{angle}"] for angle in ("Yaw", "Pitch")]
        for eye in ("leftEye", "rightEye"):
            x, y, z = turned(avatar, pose, "neck") @ turned(avatar, pose, eye) @ [0, 0, 1]
            np.testing.assert_allclose([math.atan2(x, z), math.asin(y)], aim, rtol=0, atol=0.003)
        farthest = np.maximum(farthest, np.abs(aim))
    assert np.all(np.degrees(farthest) > [5, 2]), "no glance was seen"


def turned(avatar: Any, pose: Pose, joint: str) -> Any:
    """The turn of a joint in mesh axes, [3, 3], about those of its parents."""
    world = np.eye(3)
    at = avatar.rig.joint_names.index(joint)
    while at >= 0:
        world = avatar.rig.rest_local[at, :3, :3].astype(float) @ world
        at = int(avatar.rig.parents[at])
    return world @ pose.joints[joint][:3, :3] @ np.linalg.inv(world)
