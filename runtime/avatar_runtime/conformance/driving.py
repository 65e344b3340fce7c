"""What a player computes on the CPU: reference cases of `driving` and of stage `joints`, and how they are judged."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar, Rig
from avatar_runtime.conformance.arrays import (
    DRIVING,
    DRIVING_ARRAYS,
    JUDGED,
    WHEN,
    inputs_of,
    tolerances,
)
from avatar_runtime.conformance.driving_checks import check_driving_fits
from avatar_runtime.conformance.judge import judge
from avatar_runtime.conformance.model import DrivingCase, DrivingReference, Expected, Step, Tensor
from avatar_runtime.conformance.run import Report, Row, check_given
from avatar_runtime.conformance.stages import joints_alone, posed_anchors
from avatar_runtime.conformance.steps import step_tensors
from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import frame_of
from avatar_runtime.pose import PoseArrays, resolve
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec

Triples = tuple[tuple[float, float, float], ...]
UNMEASURED: Triples = ((0.0, 0.0, 0.0),) * 3
SEED = 14  # of the posed joints


class _Captured(NamedTuple):
    """A captured frame: weights as 64ths by place in ARKIT_NAMES, and (yaw, pitch, roll) of head, leftEye, rightEye."""

    name: str
    why: str
    first: float  # 64ths, weight of the first name
    step: float  # 64ths, from one name to the next
    angles: Triples = UNMEASURED
    within_range: bool = False


# Each name has a weight of its own, so that no two names can change places.
CAPTURED: tuple[_Captured, ...] = (
    _Captured("still", "nothing is measured: all weights are 0, joints stay at rest", 0, 0),
    _Captured("weights", "names reach their own outputs; eyes follow the weights", 1, 1),
    _Captured(
        "measured",
        "axes, signs and order of angles; channels leftEye belong to the subject's right eye; a measured eye replaces "
        "the matrix, the head is added to it",
        52,
        -1,
        ((0.3, -0.2, 0.15), (-0.12, 0.21, 0.04), (0.17, -0.09, -0.05)),
    ),
    _Captured(
        "one_eye",
        "only the channels leftEye are measured; the other eye follows the matrix or the weights",
        20,
        0.5,
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.11), (0.0, 0.0, 0.0)),
    ),
    _Captured(
        "turned",
        "angles near half a turn, where the order of yaw, pitch and roll shows",
        26,
        -0.5,
        ((2.5, -1.3, -2.9), (1.1, 0.8, -0.7), (-1.4, 0.9, 1.2)),
    ),
    _Captured("beyond", "weights below 0 and above 1 are used as they come", -64, 4),
    _Captured("limited", "the same, limited to the ranges after the matrix", -64, 4, within_range=True),
    _Captured(
        "faint", "rotation vectors whose squared length is 0 in float32: no division by it", 2.0**-74, 0
    ),
)


def driving_cases(avatar: Avatar, handedness: str = "right", generator: str = "") -> DrivingReference:
    """Cases for `avatar`, whose arrays are in the frame of `handedness`. The same avatar gives the same cases.

    Every captured frame of CAPTURED through `driving` and stage `joints`, where ARKit names can drive the avatar, and
    one pose of all joints through stage `joints` alone. Stage `joints` is left out where there is no rig, so a still
    avatar has no cases. Raises AvatarError for a joint that cannot rotate.
    """
    tensors: dict[str, Tensor] = {}
    captured = CAPTURED if avatar.driving.mode != "none" else ()
    cases = [_captured_case(avatar, row, handedness, tensors) for row in captured]
    if avatar.rig is not None:
        cases.append(_posed_case(avatar, avatar.rig, tensors))
    used = {name for case in cases for step in case.steps for name in step_tensors(step)}
    kept = {name: tensors[name] for name in sorted(used)}
    return DrivingReference(generator, avatar.name, handedness, kept, tuple(cases))


def _captured_case(
    avatar: Avatar, row: _Captured, handedness: str, tensors: dict[str, Tensor]
) -> DrivingCase:
    driver = Driver(avatar, within_range=row.within_range, handedness=handedness)
    tensors[f"{row.name}/channels"] = channels = _channels(row)
    arrays = _driven(avatar, driver, channels)
    outputs = _kept(tensors, row.name, DRIVING, _outputs(arrays))
    step = Step(DRIVING, None, {"channels": f"{row.name}/channels"}, outputs)
    return DrivingCase(
        row.name, row.why, row.within_range, (step, *_joints(avatar, row.name, arrays, tensors))
    )


def _posed_case(avatar: Avatar, rig: Rig, tensors: dict[str, Tensor]) -> DrivingCase:
    arrays = _posed(avatar, rig)
    tensors |= {f"posed/{DRIVING}/{name}": array for name, array in _outputs(arrays).items()}
    why = "all joints turn, move and stretch: kinematic chain, pose features, transforms of the groups"
    return DrivingCase("posed", why, False, _joints(avatar, "posed", arrays, tensors))


def conform_driving(avatar: Avatar, reference: DrivingReference) -> Report:
    """Judges the runtime by `reference`, which belongs to `avatar`. Both are in the frame of the reference.

    Raises AvatarError if the reference was not made for `avatar`.
    """
    check_driving_fits(reference, avatar)
    rows: list[Row] = []
    for case in reference.cases:
        for step in case.steps:
            inputs = {array: reference.tensors[name] for array, name in step.inputs.items()}
            if step.stage == DRIVING:
                driver = Driver(avatar, within_range=case.within_range, handedness=reference.handedness)
                got = _outputs(_driven(avatar, driver, inputs["channels"]))
            else:
                got = joints_alone(avatar, inputs)
            rows += _rows(reference, case, step, got)
    return Report("reference", tuple(rows), (), ())


def conform_driving_outputs(reference: DrivingReference, tensors: Mapping[str, Tensor]) -> Report:
    """Judges the arrays that a port computed from the inputs in `reference`, named as its outputs.

    A step without any output is skipped; if only some of its outputs are given, the missing ones fail. Raises
    AvatarError for a name that is not an output, and if there are no outputs at all.
    """
    check_given((step for case in reference.cases for step in case.steps), tensors)
    rows: list[Row] = []
    skipped: list[str] = []
    for case in reference.cases:
        for step in case.steps:
            named = {array: expected.tensor for array, expected in step.outputs.items()}
            got = {array: tensors[name] for array, name in named.items() if name in tensors}
            if got:
                rows += _rows(reference, case, step, got)
            else:
                skipped.append(f"{case.name}: {step.stage}")
    return Report(None, tuple(rows), (), tuple(skipped))


def _rows(reference: DrivingReference, case: DrivingCase, step: Step, got: Mapping[str, Tensor]) -> list[Row]:
    verdicts = judge(step, got, reference.tensors)
    return [Row(case.name, step.stage, None, array, verdict, {}) for array, verdict in verdicts.items()]


def _channels(row: _Captured) -> F32:
    weights = (row.first + row.step * np.arange(len(ARKIT_NAMES))) / 64
    channels: F32 = np.concatenate([weights, np.ravel(row.angles)]).astype(np.float32)
    assert len(channels) == len(CHANNELS)
    return channels


def _driven(avatar: Avatar, driver: Driver, channels: Tensor) -> PoseArrays:
    return resolve(driver.pose(frame_of(0.0, channels)), avatar)


def _outputs(arrays: PoseArrays) -> dict[str, Tensor]:
    return {array.name: getattr(arrays, array.name) for array in DRIVING_ARRAYS.outputs}


def _joints(avatar: Avatar, case: str, pose: PoseArrays, tensors: dict[str, Tensor]) -> tuple[Step, ...]:
    """Stage `joints` from the outputs of `driving` in `tensors`; none without a rig."""
    if avatar.rig is None:
        return ()
    inputs = {array.name: f"{case}/{DRIVING}/{array.name}" for array in inputs_of("joints", avatar)}
    if WHEN["anchor"](avatar, None):
        inputs["anchor_vertices"] = f"{case}/anchor_vertices"
        tensors[inputs["anchor_vertices"]] = posed_anchors(avatar.rig, pose)
    made = joints_alone(avatar, {array: tensors[name] for array, name in inputs.items()})
    return (Step("joints", None, inputs, _kept(tensors, case, "joints", made)),)


def _kept(
    tensors: dict[str, Tensor], case: str, step: str, outputs: Mapping[str, Tensor]
) -> dict[str, Expected]:
    """Puts the outputs of a step into `tensors` and gives them their tolerances."""
    expected = {}
    for array in JUDGED[step].outputs:
        name, want = f"{case}/{step}/{array.name}", outputs[array.name]
        tensors[name] = want
        expected[array.name] = Expected(name, *tolerances(array, want, float(array.floor)))
    return expected


def _posed(avatar: Avatar, rig: Rig) -> PoseArrays:
    """Every joint turned by some 0.6 rad, moved by some millimetres and stretched unevenly; every weight in use."""
    rng = np.random.default_rng(SEED)
    joints = rig.joint_count
    stretch = np.exp(rng.normal(0, 0.05, (joints, 1, 3)))
    delta: F64 = homogeneous(
        matrix_from_rotvec(rng.normal(0, 0.35, (joints, 3))) * stretch, rng.normal(0, 4e-3, (joints, 3))
    )
    return PoseArrays(
        np.round(rng.uniform(-0.4, 1.3, len(avatar.expressions)), 3).astype(np.float32),
        np.round(rng.uniform(0, 1, len(avatar.eyelids)), 3).astype(np.float32),
        delta,
        np.eye(4),
    )
