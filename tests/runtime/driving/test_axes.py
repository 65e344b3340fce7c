from __future__ import annotations

import numpy as np
import pytest

from avatar_export.driving.takes import read_take
from avatar_runtime.driving import axes
from avatar_runtime.driving.frame import DrivingFrame
from tests.runtime.driving import axes_evidence as evidence
from tests.runtime.driving.recordings import CSV, UDP, recording

FORWARD = np.array([0.0, 0.0, 1.0])
UP = np.array([0.0, 1.0, 0.0])


def test_the_recordings_say_what_axes_documents() -> None:
    for name in (UDP, CSV):
        c = evidence.columns(name)
        for channel, side, other in (("left", "Right", "Left"), ("right", "Left", "Right")):
            own, cross = (evidence.eye_against_weights(c, channel, s) for s in (side, other))
            sign = 1 if channel == "right" else -1
            assert sign * own["Yaw"][0] == pytest.approx(axes.RADIANS_PER_EYE_WEIGHT, abs=0.02)
            assert own["Pitch"][0] == pytest.approx(axes.RADIANS_PER_EYE_WEIGHT, abs=0.005)
            assert abs(own["Yaw"][1]) < 4e-4 and own["Yaw"][2] < 5e-4
            assert abs(cross["Yaw"][1]) > 0.06 and cross["Yaw"][2] > 3 * own["Yaw"][2]
        assert evidence.convergence(c) == pytest.approx(0.065, abs=0.001)


def test_eye_roll_is_listing_s_on_the_packets() -> None:
    c = evidence.columns(UDP)
    for channel in ("left", "right"):
        assert evidence.listing_error(c, channel, 1) < 5e-6
        assert evidence.listing_error(c, channel, -1) > 0.04


def test_the_eyes_fix_the_head_s_signs() -> None:
    c = evidence.columns(UDP)
    assert evidence.gaze_sweep(c, -1) == pytest.approx(0.052, abs=1e-3)
    assert evidence.gaze_sweep(c, 1) == pytest.approx(0.273, abs=1e-3)
    errors = evidence.head_sign_errors(c)
    best, second = sorted(errors, key=lambda signs: errors[signs])[:2]
    assert best == tuple(int(s) for s in axes.HEAD_SIGNS)
    assert errors[second] > 1.3 * errors[best]


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


def test_the_gaze_in_space_holds_still() -> None:
    """With the head turned by its own signs the eyes keep to one place; turned the other way they sweep."""
    frames = read_take(recording(UDP)).frames
    gaze = [(axes.eye_rotation(f, "Left"), axes.head_rotation(f)) for f in frames]
    steady = np.array([head @ eye @ FORWARD for eye, head in gaze if eye is not None])
    swept = np.array([head.T @ eye @ FORWARD for eye, head in gaze if eye is not None])
    assert steady[:, 0].std() < 0.09 < 0.25 < swept[:, 0].std()


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


def test_order_is_yaw_then_pitch_then_roll() -> None:
    """A head yawed by 90 degrees, then pitched up by 30 about the yawed axis; roll leaves the nose alone."""
    rotation = axes.head_rotation(DrivingFrame(0, {}, head=(np.pi / 2, np.pi / 6, 0.3)))
    assert rotation @ FORWARD == pytest.approx((np.cos(np.pi / 6), np.sin(np.pi / 6), 0))


def test_an_eye_without_channels_is_not_measured() -> None:
    frame = DrivingFrame(0, {}, left_eye=(0.1, 0, 0))
    assert axes.eye_rotation(frame, "Left") is None
    assert axes.eye_rotation(frame, "Right") is not None
