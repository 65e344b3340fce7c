from __future__ import annotations

import numpy as np
import pytest

from avatar_export.driving.drive import poses, unreached
from avatar_export.driving.takes import read_take
from avatar_runtime.avatar import Driving, Expression
from avatar_runtime.driving.arkit import ARKIT_NAMES
from avatar_runtime.pose import resolve
from tests.avatars import avatar_of, rig_of
from tests.runtime.driving.recordings import CSV, recording

RIG = rig_of(("head", "leftEye"), [-1, 0], np.tile(np.eye(4), (2, 1, 1)))


def test_names_that_drive_nothing_are_known() -> None:
    avatar = avatar_of(
        ("jawOpen", "cheekPuff_L", "cheekPuff_R", "smile", Expression("x", aliases=("eyeBlink_R",)))
    )
    assert set(ARKIT_NAMES) - set(unreached(avatar)) == {"jawOpen", "cheekPuff", "eyeBlinkRight"}


def test_the_real_take_drives_and_resolves() -> None:
    avatar = avatar_of(ARKIT_NAMES[:51], RIG, Driving("names", left_eye_joint="leftEye", head_joint="head"))
    take = read_take(recording(CSV))
    made = poses(avatar, take)
    assert len(made) == 300 and unreached(avatar) == ["tongueOut"]
    jaw = [resolve(p, avatar).expression_weights[ARKIT_NAMES.index("jawOpen")] for p in made]
    assert jaw == pytest.approx(take.channels[:, ARKIT_NAMES.index("jawOpen")], abs=1e-7)
