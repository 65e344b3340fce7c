from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_runtime.avatar import Avatar, Driving, Expression
from avatar_runtime.driving import axes
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.handedness import mirrored, mirrored_pose
from avatar_runtime.io.errors import AvatarError
from tests.avatars import avatar_of, rig_of

# root turned by 90 degrees about X (as Blender exports), head above it turned about Z, eyes in it.
ROOT = np.array([[1, 0, 0, 0.1], [0, 0, -1, 0.2], [0, 1, 0, 0.3], [0, 0, 0, 1]], float)
HEAD = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]], float)
EYE = np.array([[1, 0, 0, 0.5], [0, 0.6, -0.8, 0], [0, 0.8, 0.6, 0], [0, 0, 0, 1]], float)
RIG = rig_of(("root", "head", "leftEye", "rightEye"), [-1, 0, 1, 1], np.stack([ROOT, HEAD, EYE, EYE]))
REST = {"root": ROOT, "head": ROOT @ HEAD, "leftEye": ROOT @ HEAD @ EYE, "rightEye": ROOT @ HEAD @ EYE}

# Rest transforms and matrix factors are float32.
F32 = 1e-7


def frame(head: tuple[float, float, float] = (0, 0, 0), **weights: float) -> DrivingFrame:
    return DrivingFrame(0.0, weights, head=head)


def turned(joint: str, delta: np.ndarray) -> np.ndarray:
    """The rotation in mesh axes that a delta makes, its parents at rest."""
    posed = REST[joint] @ delta
    assert posed[:3, 3] == pytest.approx(REST[joint][:3, 3])  # turns about the joint itself
    return posed[:3, :3] @ REST[joint][:3, :3].T


def test_names_drive_every_spelling() -> None:
    avatar = avatar_of(
        ("jawOpen", "cheekPuff_L", "cheekPuff_R", "smile", Expression("x", aliases=("eyeBlink_R",)))
    )
    pose = Driver(avatar).pose(frame(jawOpen=0.5, cheekPuff=0.25, eyeBlinkRight=1.0, mouthClose=0.9))
    assert pose.expressions == {"jawOpen": 0.5, "cheekPuff_L": 0.25, "cheekPuff_R": 0.25, "x": 1.0}
    assert (pose.world_from_avatar == np.eye(4)).all() and pose.joints == {}


def test_names_drive_eyelids() -> None:
    avatar = avatar_of(("jawOpen",), eyelids=("eyeBlinkLeft", "other"))
    pose = Driver(avatar).pose(frame(eyeBlinkLeft=0.75))
    assert pose.eyelids == {"eyeBlinkLeft": 0.75}


def test_none_says_how_to_get_a_matrix() -> None:
    with pytest.raises(AvatarError, match=r"tiny: driving: ARKit weights cannot drive.*--driving FILE"):
        Driver(avatar_of(("expr_0",), driving=Driving())).pose(frame())


def matrix_avatar(**joints: str) -> Avatar:
    rows = {
        "expression/a": [1.0, 2.0],
        "eyelid/lid": [0.0, -0.5],
        "joint/head/x": [0.2, 0.0],
        "joint/leftEye/y": [0.0, 0.4],
        "joint/leftEye/z": [0.3, 0.0],
    }
    matrix = np.array(list(rows.values()), np.float32)
    driving = Driving("matrix", ("jawOpen", "eyeLookOutLeft"), tuple(rows), matrix, **joints)
    return avatar_of(("a", "b"), RIG, driving, ("lid",))


def test_matrix_drives_weights_eyelids_and_joints_in_mesh_axes() -> None:
    pose = Driver(matrix_avatar()).pose(frame(jawOpen=0.5, eyeLookOutLeft=0.25))
    assert pose.expressions == pytest.approx({"a": 1.0})
    assert pose.eyelids == pytest.approx({"lid": -0.125})
    c, s = np.cos(0.1), np.sin(0.1)
    assert turned("head", pose.joints["head"]) == pytest.approx(
        np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), abs=F32
    )
    # Rotation vector (0, 0.1, 0.15): its axis stays, and its angle is its length.
    eye = turned("leftEye", pose.joints["leftEye"])
    assert eye @ [0, 0.1, 0.15] == pytest.approx([0, 0.1, 0.15], abs=F32)
    assert np.trace(eye) == pytest.approx(1 + 2 * np.cos(np.hypot(0.1, 0.15)))
    assert eye[0, 2] > 0  # about +Y: forward goes to the subject's left


def test_head_goes_to_its_joint_on_top_of_the_matrix() -> None:
    given_head = frame((0.3, 0, 0), jawOpen=0.5)
    pose = Driver(matrix_avatar(head_joint="head")).pose(given_head)
    rotation = turned("head", pose.joints["head"])
    assert rotation == pytest.approx(axes.head_rotation(given_head) @ turned("head", matrix_pose_head()))
    assert (pose.world_from_avatar == np.eye(4)).all()


def matrix_pose_head() -> np.ndarray:
    return Driver(matrix_avatar()).pose(frame(jawOpen=0.5)).joints["head"]


def test_head_without_a_joint_turns_the_avatar_about_its_pivot() -> None:
    avatar = avatar_of(driving=Driving("names", head_pivot=(1.0, 2.0, 3.0)))
    world = Driver(avatar).pose(frame((np.pi / 2, 0, 0))).world_from_avatar
    assert world @ [1, 2, 3, 1] == pytest.approx([1, 2, 3, 1])
    assert world @ [1, 2, 4, 1] == pytest.approx([2, 2, 3, 1])  # the nose goes to the subject's left


def test_a_measured_eye_replaces_the_matrix_and_never_adds_to_it() -> None:
    avatar = matrix_avatar(left_eye_joint="leftEye", right_eye_joint="rightEye")
    weights = {"jawOpen": 0.5, "eyeLookOutLeft": 0.25, "eyeLookDownRight": 0.5}
    measured = DrivingFrame(0, weights, left_eye=(0.02, 0.1, 0), right_eye=(-0.1, 0.3, 0))
    pose = Driver(avatar).pose(measured)
    assert turned("leftEye", pose.joints["leftEye"]) == pytest.approx(
        axes.eye_rotation(measured, "Left"), abs=F32
    )
    assert turned("rightEye", pose.joints["rightEye"]) == pytest.approx(
        axes.eye_rotation(measured, "Right"), abs=F32
    )
    without = Driver(avatar).pose(DrivingFrame(0, weights))
    only_matrix = Driver(matrix_avatar()).pose(DrivingFrame(0, weights))
    assert without.joints["leftEye"] == pytest.approx(only_matrix.joints["leftEye"])
    down = turned("rightEye", without.joints["rightEye"]) @ [0, 0, 1]
    assert down == pytest.approx([0, -np.sin(0.3045), np.cos(0.3045)], abs=F32)


def test_a_joint_flattened_at_rest_is_refused() -> None:
    flat = RIG.rest_local.copy()
    flat[1, :3, 0] = 0
    avatar = avatar_of(("jawOpen",), replace(RIG, rest_local=flat))
    with pytest.raises(AvatarError, match="joint head: has a singular rest transform"):
        Driver(avatar).pose(frame())


def test_weights_are_limited_to_their_ranges_only_on_request() -> None:
    shapes = (Expression("jawOpen", range=(0.25, 0.5)), Expression("mouthLeft", range=(-1.0, 2.0)))
    avatar = avatar_of((*shapes, "other"), eyelids=("eyeBlinkLeft", "eyeBlinkRight"))
    low = frame(jawOpen=-1.0, mouthLeft=-1.5, eyeBlinkLeft=-0.5, eyeBlinkRight=0.5)
    high = frame(jawOpen=1.0, mouthLeft=1.5, eyeBlinkLeft=1.5, eyeBlinkRight=0.5)
    plain, limited = Driver(avatar), Driver(avatar, within_range=True)
    assert plain.pose(low).expressions == {"jawOpen": -1.0, "mouthLeft": -1.5}
    assert plain.pose(high).eyelids == {"eyeBlinkLeft": 1.5, "eyeBlinkRight": 0.5}
    assert limited.pose(low).expressions == {"jawOpen": 0.25, "mouthLeft": -1.0}
    assert limited.pose(high).expressions == {"jawOpen": 0.5, "mouthLeft": 1.5}
    assert limited.pose(low).eyelids == {"eyeBlinkLeft": 0.0, "eyeBlinkRight": 0.5}
    assert limited.pose(high).eyelids == {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 0.5}


def test_a_range_limits_the_sum_and_not_its_inputs() -> None:
    driving = Driving(
        "matrix", ("jawOpen", "mouthLeft"), ("expression/a",), np.array([[2.0, -2.0]], np.float32)
    )
    avatar = avatar_of((Expression("a", range=(0.0, 1.0)),), driving=driving)
    driver = Driver(avatar, within_range=True)
    assert driver.pose(frame(jawOpen=1.5, mouthLeft=1.25)).expressions == {"a": 0.5}
    assert driver.pose(frame(jawOpen=1.5)).expressions == {"a": 1.0}


def test_another_handedness_is_refused() -> None:
    with pytest.raises(ValueError, match="'up' is not one of right, left"):
        Driver(avatar_of(), handedness="up")


def test_the_mirrored_avatar_gets_the_mirrored_pose() -> None:
    avatar = matrix_avatar(head_joint="head", left_eye_joint="leftEye", right_eye_joint="rightEye")
    given = DrivingFrame(
        0, {"jawOpen": 0.7, "eyeLookUpRight": 0.3}, (0.3, -0.2, 0.1), right_eye=(0.1, 0.2, 0.3)
    )
    found = Driver(mirrored(avatar), handedness="left").pose(given)
    want = mirrored_pose(Driver(avatar).pose(given))
    assert found.expressions == want.expressions and found.joints.keys() == want.joints.keys()
    for joint, delta in want.joints.items():
        assert found.joints[joint] == pytest.approx(delta, abs=1e-12)
