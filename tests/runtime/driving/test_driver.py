"""What a driver refuses, and ranges; `tests/conformance` judges the poses that it makes."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.avatar import Driving, Expression
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.io.errors import AvatarError
from tests.avatars import avatar_of, rig_of


def frame(head: tuple[float, float, float] = (0, 0, 0), **weights: float) -> DrivingFrame:
    return DrivingFrame(0.0, weights, head=head)


def test_none_says_how_to_get_a_matrix() -> None:
    with pytest.raises(AvatarError, match=r"tiny: driving: ARKit weights cannot drive.*--driving FILE"):
        Driver(avatar_of(("expr_0",), driving=Driving())).pose(frame())


def test_a_joint_flattened_at_rest_is_refused() -> None:
    flat = np.stack([np.eye(4), np.diag([0.0, 1, 1, 1])])
    avatar = avatar_of(("jawOpen",), rig_of(("root", "head"), [-1, 0], flat))
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
