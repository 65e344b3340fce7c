"""Vectors of `driving` and of stage `joints`: the runtime, an oracle of its own, and planted faults against them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avatar_runtime.avatar import Avatar
from avatar_runtime.conformance import DrivingReference, Report, conform_driving, conform_driving_outputs
from avatar_runtime.driving import axes, driver
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.driving.driver import Driver
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rotation import homogeneous
from tests.conformance.driving_vectors import AVATARS, committed, made
from tests.measured import Measure
from tests.oracles import driving as oracle


def failures(report: Report) -> set[tuple[str, str, str]]:
    return {(row.case, row.stage, row.array) for row in report.rows if not row.passed}


def by_oracle(avatar: Avatar, reference: DrivingReference) -> dict[str, Any]:
    """The outputs of every case, by the oracle."""
    outputs: dict[str, Any] = {}
    for case in reference.cases:
        for step in case.steps:
            x = {array: reference.tensors[name] for array, name in step.inputs.items()}
            if step.stage == "driving":
                channels = dict(zip(CHANNELS, map(float, x["channels"]), strict=True))
                left = reference.handedness == "left"
                got = oracle.driven(avatar, channels, within_range=case.within_range, left_handed=left)
            else:
                assert avatar.rig is not None
                got = oracle.skeleton(avatar, avatar.rig, x)
            outputs |= {expected.tensor: got[array] for array, expected in step.outputs.items()}
    return outputs


@pytest.mark.parametrize("name", AVATARS)
def test_the_runtime_repeats_the_vectors(name: str, measured: Measure) -> None:
    report = conform_driving(AVATARS[name](), committed(name))
    assert failures(report) == set() and report.passed and report.first_failure is None
    assert {row.case for row in report.rows} == {case.name for case in committed(name).cases}
    used = max(row.verdict.used for row in report.rows)
    measured("conformance, driving and joints: share of the tolerance", used, 1)


@pytest.mark.parametrize("name", AVATARS)
def test_an_oracle_that_shares_no_code_agrees(name: str, measured: Measure) -> None:
    avatar, reference = AVATARS[name](), committed(name)
    report = conform_driving_outputs(reference, by_oracle(avatar, reference))
    assert failures(report) == set() and not report.skipped
    used = max(row.verdict.used for row in report.rows)
    measured("conformance, driving and joints by an oracle: share of the tolerance", used, 1)


@pytest.mark.parametrize("name", AVATARS)
def test_committed_vectors_are_of_the_cases(name: str) -> None:
    found, want = committed(name), made(name)
    assert (found.avatar, found.handedness, found.generator) == (want.avatar, want.handedness, want.generator)
    assert found.tensors.keys() == want.tensors.keys()
    for case, fresh in zip(found.cases, want.cases, strict=True):
        assert (case.name, case.why, case.within_range) == (fresh.name, fresh.why, fresh.within_range)
        for step, again in zip(case.steps, fresh.steps, strict=True):
            assert (step.stage, step.inputs) == (again.stage, again.inputs)
            for array, expected in again.outputs.items():
                approximately = replace(step.outputs[array], atol=expected.atol)
                assert approximately == expected
                assert step.outputs[array].atol == pytest.approx(expected.atol, rel=1e-4)
        if "channels" in case.steps[0].inputs:
            channels = found.tensors[f"{case.name}/channels"]
            np.testing.assert_array_equal(channels, want.tensors[f"{case.name}/channels"])


def unranged(self: Any, *_: Any) -> None:
    self._expression_range = self._late_range = {}


def added_eyes(self: Driver, turns: dict[str, Any], frame: Any) -> None:
    """A measured eye on top of the matrix."""
    before = dict(turns)
    true_eyes(self, turns, frame)
    for joint in before.keys() & {j for j in self._eyes.values() if j}:
        if turns[joint] is not before[joint]:
            turns[joint] = turns[joint] @ before[joint]


def made_then(change: Callable[[Any], object]) -> Callable[..., None]:
    def init(self: Any, *args: Any, **options: Any) -> None:
        true_init(self, *args, **options)
        change(self)

    return init


true_init, true_eyes, true_rotation = Driver.__init__, Driver._turn_eyes, axes._rotation
SWAPPED = {"Left": "Right", "Right": "Left"}
true_eye = axes.eye_rotation
FAULTS: dict[
    str, tuple[Any, str, Any, str]
] = {  # what, attribute, fault, a case of `matrix` or `names` that fails
    "yaw of the head": (axes, "HEAD_SIGNS", (-1.0, -1.0, 1.0), "measured"),
    "pitch of the head": (axes, "HEAD_SIGNS", (1.0, 1.0, 1.0), "measured"),
    "roll of the head": (axes, "HEAD_SIGNS", (1.0, -1.0, -1.0), "measured"),
    "yaw of an eye": (axes, "EYE_SIGNS", (1.0, 1.0, -1.0), "weights"),
    "pitch of an eye": (axes, "EYE_SIGNS", (-1.0, -1.0, -1.0), "weights"),
    "roll of an eye": (axes, "EYE_SIGNS", (-1.0, 1.0, 1.0), "one_eye"),
    "angle of an eyeLook weight": (axes, "RADIANS_PER_EYE_WEIGHT", 0.6109, "weights"),
    "sides of the recorder": (axes, "eye_rotation", lambda f, side: true_eye(f, SWAPPED[side]), "one_eye"),
    "order of the angles": (axes, "_rotation", lambda e, s: true_rotation(e, s).T, "turned"),
    "eyes added to the matrix": (Driver, "_turn_eyes", added_eyes, "measured"),
    "ranges left out": (Driver, "__init__", made_then(unranged), "limited"),
    "ranges always": (
        Driver,
        "__init__",
        lambda self, avatar, within_range=False, handedness="right": true_init(
            self, avatar, within_range=True, handedness=handedness
        ),
        "beyond",
    ),
    "rest frames left out": (
        driver,
        "_rest_frames",
        lambda avatar: dict.fromkeys(avatar.rig.joint_names, np.eye(3)),
        "weights",
    ),
    "a rotation vector as three angles": (
        driver,
        "matrix_from_rotvec",
        lambda v: true_rotation((v[1], v[0], v[2]), (1.0, 1.0, 1.0)),
        "weights",
    ),
    "pivot left out": (
        Driver,
        "__init__",
        made_then(lambda self: vars(self).update(_mesh_from_pivot=np.eye(4))),
        "measured",
    ),
    "no head": (axes, "head_rotation", lambda frame: np.eye(3), "measured"),
    "sides of the matrix": (driver, "homogeneous", lambda m: homogeneous(m.T), "measured"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_planted_fault_is_found(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    owner, name, wrong, case = FAULTS[fault]
    monkeypatch.setattr(owner, name, wrong)
    reports = [conform_driving(AVATARS[avatar](), committed(avatar)) for avatar in ("matrix", "names")]
    found = {row.case for report in reports for row in report.rows if not row.passed}
    assert case in found and {report.first_failure for report in reports} <= {"driving", None}
    assert {row.stage for report in reports for row in report.rows if not row.passed} == {"driving"}


def test_the_frame_of_the_other_hand_is_found() -> None:
    right = replace(committed("matrix_left"), handedness="right")
    assert failures(conform_driving(AVATARS["matrix_left"](), right))


def test_a_port_that_leaves_something_out_is_told() -> None:
    reference = committed("matrix")
    given = by_oracle(AVATARS["matrix"](), reference)
    kept = {name: a for name, a in given.items() if "/joints/" not in name}
    assert "measured: joints" in conform_driving_outputs(reference, kept).skipped
    del kept["measured/driving/joint_delta"]
    kept["turned/driving/joint_delta"] = kept["turned/driving/joint_delta"].swapaxes(1, 2)
    found = failures(conform_driving_outputs(reference, kept))
    assert found == {("measured", "driving", "joint_delta"), ("turned", "driving", "joint_delta")}
    with pytest.raises(AvatarError, match="measured/driving/joint_delta"):
        conform_driving_outputs(reference, {"measured/driving/joint_deltas": np.zeros(1)})
    with pytest.raises(AvatarError, match="holds no output"):
        conform_driving_outputs(reference, {})


@pytest.mark.parametrize("other", ["names", "unrigged", "undriven", "head_bone"])
def test_vectors_of_another_avatar(other: str) -> None:
    """Refused, or judged wrong where all sizes are the same."""
    try:
        assert failures(conform_driving(AVATARS[other](), committed("matrix")))
    except AvatarError as error:
        assert "driving" in str(error) and "\n" not in str(error)
