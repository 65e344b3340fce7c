from __future__ import annotations

import numpy as np
import pytest

from avatar_export.driving.takes import read_take
from avatar_runtime.driving import axes
from avatar_runtime.driving.frame import DrivingFrame
from tests.runtime.driving.recordings import UDP, recording

FORWARD = np.array([0.0, 0.0, 1.0])
UP = np.array([0.0, 1.0, 0.0])


def test_gaze_of_an_eye_follows_the_weights_of_its_side() -> None:
    take = read_take(recording(UDP))
    for side, outward in (("Left", 1), ("Right", -1)):
        for frame in take.frames[::20]:
            rotation = axes.eye_rotation(frame, side)
            assert rotation is not None
            gaze = rotation @ FORWARD
            w = {way: frame.weights[f"eyeLook{way}{side}"] for way in ("In", "Out", "Up", "Down")}
            # +X is the subject's left: out for the left eye.
            assert np.arctan2(gaze[0], gaze[2]) == pytest.approx(
                outward * 0.609 * (w["Out"] - w["In"]), abs=1.5e-3
            )
            assert np.arcsin(gaze[1]) == pytest.approx(0.61 * (w["Up"] - w["Down"]), abs=1.5e-3)
            from_weights = axes.eye_rotation_from_weights(frame.weights, side) @ FORWARD
            assert np.abs(from_weights - gaze).max() < 2e-3


@pytest.mark.parametrize(
    ("euler", "nose", "crown"),
    [
        ((0.1, 0, 0), (np.sin(0.1), 0, np.cos(0.1)), (0, 1, 0)),  # yaw +: to the subject's left
        ((0, 0.1, 0), (0, np.sin(0.1), np.cos(0.1)), (0, np.cos(0.1), -np.sin(0.1))),  # pitch +: up
        ((0, 0, 0.1), (0, 0, 1), (-np.sin(0.1), np.cos(0.1), 0)),  # roll +: crown to the subject's right
    ],
)
def test_head_signs(
    euler: tuple[float, float, float], nose: tuple[float, ...], crown: tuple[float, ...]
) -> None:
    rotation = axes.head_rotation(DrivingFrame(0, {}, head=euler))
    assert rotation @ FORWARD == pytest.approx(nose)
    assert rotation @ UP == pytest.approx(crown)
