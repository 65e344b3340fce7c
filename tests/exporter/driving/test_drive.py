from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_export.driving import axes
from avatar_export.driving.arkit import ARKIT_NAMES
from avatar_export.driving.drive import pose_from_frame, poses, unreached
from avatar_export.driving.frames import DrivingFrame
from avatar_export.driving.matrix import with_driving
from avatar_export.driving.takes import read_take
from avatar_runtime.avatar import Avatar, Driving, Expression
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import resolve
from tests.exporter.driving.recordings import CSV, avatar_of, recording, rig_of
from tests.session.fuzz import examples

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
    pose = pose_from_frame(avatar, frame(jawOpen=0.5, cheekPuff=0.25, eyeBlinkRight=1.0, mouthClose=0.9))
    assert pose.expressions == {"jawOpen": 0.5, "cheekPuff_L": 0.25, "cheekPuff_R": 0.25, "x": 1.0}
    assert set(ARKIT_NAMES) - set(unreached(avatar)) == {"jawOpen", "cheekPuff", "eyeBlinkRight"}
    assert (pose.world_from_avatar == np.eye(4)).all() and pose.joints == {}


def test_names_drive_eyelids() -> None:
    avatar = avatar_of(("jawOpen",), eyelids=("eyeBlinkLeft", "other"))
    pose = pose_from_frame(avatar, frame(eyeBlinkLeft=0.75))
    assert pose.eyelids == {"eyeBlinkLeft": 0.75}


def test_the_real_take_drives_and_resolves() -> None:
    avatar = avatar_of(ARKIT_NAMES[:51], RIG, Driving("names", left_eye_joint="leftEye", head_joint="head"))
    take = read_take(recording(CSV))
    made = poses(avatar, take)
    assert len(made) == 300 and unreached(avatar) == ["tongueOut"]
    jaw = [resolve(p, avatar).expression_weights[ARKIT_NAMES.index("jawOpen")] for p in made]
    assert jaw == pytest.approx(take.channels[:, ARKIT_NAMES.index("jawOpen")], abs=1e-7)


def test_none_says_how_to_get_a_matrix() -> None:
    with pytest.raises(AvatarError, match=r"tiny: driving: ARKit weights cannot drive.*--driving FILE"):
        pose_from_frame(avatar_of(("expr_0",), driving=Driving()), frame())


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
    pose = pose_from_frame(matrix_avatar(), frame(jawOpen=0.5, eyeLookOutLeft=0.25))
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
    pose = pose_from_frame(matrix_avatar(head_joint="head"), given_head)
    rotation = turned("head", pose.joints["head"])
    assert rotation == pytest.approx(axes.head_rotation(given_head) @ turned("head", matrix_pose_head()))
    assert (pose.world_from_avatar == np.eye(4)).all()


def matrix_pose_head() -> np.ndarray:
    return pose_from_frame(matrix_avatar(), frame(jawOpen=0.5)).joints["head"]


def test_head_without_a_joint_turns_the_avatar_about_its_pivot() -> None:
    avatar = avatar_of(driving=Driving("names", head_pivot=(1.0, 2.0, 3.0)))
    world = pose_from_frame(avatar, frame((np.pi / 2, 0, 0))).world_from_avatar
    assert world @ [1, 2, 3, 1] == pytest.approx([1, 2, 3, 1])
    assert world @ [1, 2, 4, 1] == pytest.approx([2, 2, 3, 1])  # the nose goes to the subject's left


def test_a_measured_eye_replaces_the_matrix_and_never_adds_to_it() -> None:
    avatar = matrix_avatar(left_eye_joint="leftEye", right_eye_joint="rightEye")
    weights = {"jawOpen": 0.5, "eyeLookOutLeft": 0.25, "eyeLookDownRight": 0.5}
    measured = DrivingFrame(0, weights, left_eye=(0.02, 0.1, 0), right_eye=(-0.1, 0.3, 0))
    pose = pose_from_frame(avatar, measured)
    assert turned("leftEye", pose.joints["leftEye"]) == pytest.approx(
        axes.eye_rotation(measured, "Left"), abs=F32
    )
    assert turned("rightEye", pose.joints["rightEye"]) == pytest.approx(
        axes.eye_rotation(measured, "Right"), abs=F32
    )
    without = pose_from_frame(avatar, DrivingFrame(0, weights))
    only_matrix = pose_from_frame(matrix_avatar(), DrivingFrame(0, weights))
    assert without.joints["leftEye"] == pytest.approx(only_matrix.joints["leftEye"])
    down = turned("rightEye", without.joints["rightEye"]) @ [0, 0, 1]
    assert down == pytest.approx([0, -np.sin(0.3045), np.cos(0.3045)], abs=F32)


def test_a_joint_flattened_at_rest_is_refused() -> None:
    flat = RIG.rest_local.copy()
    flat[1, :3, 0] = 0
    avatar = avatar_of(("jawOpen",), replace(RIG, rest_local=flat))
    with pytest.raises(AvatarError, match="joint head: has a singular rest transform"):
        pose_from_frame(avatar, frame())


GOOD = {
    "inputs": ["JawOpen", "eyeBlink_L"],
    "outputs": ["expression/al", "joint/head/x"],
    "matrix": [[1, 0], [0, 2]],
}
TARGET = avatar_of((Expression("a", aliases=("al",)),), RIG, Driving(head_joint="head"), ("lid",))


def write(path: Path, document: object) -> Path:
    path.write_text(document if isinstance(document, str) else json.dumps(document))
    return path


def test_matrix_file(tmp_path: Path) -> None:
    avatar = check_avatar(with_driving(TARGET, write(tmp_path / "m.json", GOOD)))
    d = avatar.driving
    assert (d.mode, d.inputs, d.outputs, d.head_joint) == (
        "matrix",
        ("jawOpen", "eyeBlinkLeft"),
        ("expression/a", "joint/head/x"),
        "head",
    )
    assert d.matrix is not None and d.matrix.tolist() == [[1, 0], [0, 2]]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            {"inputs": ["JawOpn", "eyeBlink_L"]},
            "inputs[0]: 'JawOpn' is not an ARKit name; did you mean jawOpen",
        ),
        ({"inputs": ["jawOpen", "JawOpen"]}, "inputs: entries 0 and 1 are both jawOpen"),
        ({"inputs": [1, 2]}, "inputs[0]: 1 is not a name"),
        ({"inputs": []}, "inputs: is empty"),
        ({"outputs": ["expression/b", "joint/head/x"]}, "outputs[0]: 'expression/b' is not a driving output"),
        ({"outputs": ["expression/a", "expression/al"]}, "both expression/a"),
        ({"outputs": ["expression/a", "joint/head/w"]}, "did you mean joint/head/"),
        ({"outputs": "expression/a"}, "needs an object with the lists"),
        ({"matrix": [[1, 0]]}, "matrix: has 1 rows for 2 outputs"),
        ({"matrix": [[1, 0], [1]]}, "matrix[1]: has 1 numbers for 2 inputs"),
        ({"matrix": [[1, 0], 3]}, "matrix[1]: has no numbers"),
        ({"matrix": [[1, 0], [float("nan"), 0]]}, "matrix[1][0]: nan is not a finite factor"),
        ({"matrix": [[1, True], [0, 0]]}, "matrix[0][1]"),
        ({"matrix": [[10**400, 0], [0, 0]]}, "matrix[0][0]"),
        ({"matrix": [[1, [2]], [0, 0]]}, "matrix[0][1]: list is no"),
    ],
)
def test_bad_matrix(tmp_path: Path, change: dict[str, object], said: str) -> None:
    with pytest.raises(AvatarError, match=r"m\.json") as caught:
        with_driving(TARGET, write(tmp_path / "m.json", GOOD | change))
    assert said in str(caught.value)


@pytest.mark.parametrize("text", ["", "[1]", "{", '{"inputs": ' + "[" * 100_000, "\ufeff{}", "1" * 5000])
def test_no_json(tmp_path: Path, text: str) -> None:
    with pytest.raises(AvatarError, match=r"m\.json"):
        with_driving(TARGET, write(tmp_path / "m.json", text))


LEAF = (
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from(["jawOpen", "expression/a", "x"])
)
TREE = st.recursive(LEAF, lambda inner: st.lists(inner, max_size=3), max_leaves=6)


@settings(max_examples=examples(100))
@given(st.fixed_dictionaries({}, optional={"inputs": TREE, "outputs": TREE, "matrix": TREE}))
def test_no_document_breaks_the_matrix_reader(tmp_path_factory: pytest.TempPathFactory, change: dict) -> None:
    path = tmp_path_factory.getbasetemp() / "any.json"
    try:
        check_avatar(with_driving(TARGET, write(path, GOOD | change)))
    except AvatarError as error:
        assert "\n" not in str(error)
