"""Avatars whose vectors of `driving` and stage `joints` are committed: what is driven differs, every binding is there.

    python -m tests.conformance.driving_vectors

rewrites the vectors. Regenerating blesses new behaviour.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from avatar_runtime.avatar import Avatar, Driving, Expression, Rules
from avatar_runtime.bundle import opener
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.conformance import DrivingReference, decode_driving, driving_cases, encode_driving
from avatar_runtime.handedness import mirrored
from tests.avatars import full_avatar
from tests.conformance import avatars

DATA = Path(__file__).parent / "driving_data"
SPELLED = (
    Expression("JawOpen", (), (0.0, 1.0)),
    Expression("cheekPuff_L", (), (-0.25, 0.5)),
    Expression("fourth", ("stranger", "BS_node.eyeLookOut_L"), (0.125, 0.75)),
    Expression("exp_003", (), (-2.0, 2.0)),
)
INPUTS = ("mouthSmileLeft", "jawOpen", "eyeLookOutLeft", "eyeBlinkLeft", "eyeLookInRight")
OUTPUTS = (
    *("joint/neck/z", "expression/exp_003", "joint/jaw/x", "joint/leftEye/y", "eyelid/right"),
    *("joint/neck/x", "expression/jawOpen", "joint/jaw/z", "expression/mouthSmileRight"),
)


def _matrix() -> Avatar:
    """Joints by one or two axes, one of them the head's and one an eye's; the other eye only by its weights."""
    full, rng = full_avatar(3), np.random.default_rng(3)
    matrix = rng.normal(0, 0.5, (len(OUTPUTS), len(INPUTS))).astype(np.float32)
    driving = replace(full.driving, inputs=INPUTS, outputs=OUTPUTS, matrix=matrix)
    return check_avatar(replace(full, driving=driving))


def _names() -> Avatar:
    """Names in other spellings, aliases, eyelids; the head turns the whole about a pivot."""
    driving = Driving(
        "names", head_pivot=(0.03, -0.11, 0.02), left_eye_joint="leftEye", right_eye_joint="rightEye"
    )
    late = ("eyeBlinkLeft", "AK_09_EyeBlinkRight")
    return check_avatar(replace(full_avatar(5), expressions=SPELLED, eyelids=late, driving=driving, clips=()))


def _unrigged() -> Avatar:
    made = avatars.AVATARS["still"]()
    driving = Driving("names", head_pivot=(-0.02, 0.05, 0.01))
    return check_avatar(replace(made, expressions=SPELLED, driving=driving))


AVATARS: Mapping[str, Callable[[], Avatar]] = {
    "names": _names,
    "matrix": _matrix,
    "matrix_left": lambda: mirrored(_matrix()),
    "head_bone": lambda: replace(_matrix(), rules=Rules("head_bone", "neck", anchor="repeats")),
    "stretched": avatars.AVATARS["surface_unbound"],  # joints whose rest frames are stretched unevenly
    "unrigged": _unrigged,
    "undriven": lambda: replace(full_avatar(7), driving=Driving()),
}


def made(name: str) -> DrivingReference:
    """The cases of an avatar, made now."""
    handedness = "left" if name.endswith("_left") else "right"
    return driving_cases(AVATARS[name](), handedness, "tests/conformance")


@cache
def committed(name: str) -> DrivingReference:
    """The committed cases of an avatar."""
    return decode_driving(opener(DATA / name))


def regenerate() -> None:
    """A folder for every avatar, nothing else in DATA."""
    shutil.rmtree(DATA, ignore_errors=True)
    for name in AVATARS:
        (DATA / name).mkdir(parents=True)
        for file, data in encode_driving(made(name)).items():
            (DATA / name / file).write_bytes(data)


if __name__ == "__main__":
    regenerate()
