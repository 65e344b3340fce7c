"""The nine rotation channels of Live Link Face as rotations in mesh axes.

Mesh axes: right-handed, +X the subject's left, +Y up, face +Z. The app documents neither axes nor signs;
they were found from two recordings:

- Radians. An eye channel is 0.609 rad (35 degrees) times the difference of its eyeLook weights.
- Sides. rightEyeYaw = 0.6093 (eyeLookInLeft - eyeLookOutLeft) with offset 0.0000 and residual 0.00024 rad;
  against the *Right* weights the offset is 0.0649 and the residual 0.00289, twelve times as much. So the
  channels named rightEye measure the eye that the weights call Left, and the reverse; so do those of the CSV.
  The weights decide (Apple: left is the subject's, eyeLookInLeft goes with a gaze to the right).
- Eyes: positive yaw looks to the subject's right, positive pitch down (slope +0.61 on Down - Up). With these
  sides the eyes converge by 0.065 rad, on a point 0.97 m away.
- Eye roll and order: eyes rotate without torsion (Listing's law), so roll is a function of yaw and pitch.
  R = Ry Rx Rz with the sign of yaw for roll has an error of 4.0e-6 rad on all 180 packets, the other sign 0.05 rad.
- Head: all signs are opposite. The subject keeps looking at one point, so the eyes rotate against the head:
  the yaw of the gaze in space then varies by 0.052 rad, with the signs of the eyes by 0.273. A model of a head on a
  neck whose eyes follow a slowly moving point fits the packets to 0.0231 rad; the other seven choices of signs
  to 0.0305 (pitch reversed), 0.0358 (roll reversed) and more. Yaw is certain, pitch and roll are well supported,
  the order is assumed to be that of the eyes.

A recorder that mirrors the image mirrors weights and angles together, which a recording cannot show.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from avatar_runtime.avatar import F64
from avatar_runtime.driving.frame import DrivingFrame, Euler
from avatar_runtime.rotation import matrix_from_rotvec

# Signs of (yaw, pitch, roll) as right-handed rotations about mesh +Y, +X, +Z.
HEAD_SIGNS = (1.0, -1.0, 1.0)
EYE_SIGNS = (-1.0, 1.0, -1.0)

# Eye rotation of one unit of an eyeLook weight, radians.
RADIANS_PER_EYE_WEIGHT = 0.609


def head_rotation(frame: DrivingFrame) -> F64:
    """The head's rotation [3, 3] in mesh axes."""
    return _rotation(frame.head, HEAD_SIGNS)


def eye_rotation(frame: DrivingFrame, side: str) -> F64 | None:
    """The rotation [3, 3] in mesh axes of the subject's "Left" or "Right" eye; None if it was not measured.

    An eye that was measured is never exactly (0, 0, 0): those are the zeros of a file without eye channels.
    """
    measured = {"Left": frame.right_eye, "Right": frame.left_eye}[side]
    return _rotation(measured, EYE_SIGNS) if any(measured) else None


def eye_rotation_from_weights(weights: Mapping[str, float], side: str) -> F64:
    """The same [3, 3] from the eyeLook weights of that side, for recordings without eye channels."""
    look = {way: weights.get(f"eyeLook{way}{side}", 0.0) for way in ("In", "Out", "Up", "Down")}
    to_the_right = look["In"] - look["Out"] if side == "Left" else look["Out"] - look["In"]
    angles = np.array([to_the_right, look["Down"] - look["Up"]]) * RADIANS_PER_EYE_WEIGHT
    return _rotation((float(angles[0]), float(angles[1]), 0.0), EYE_SIGNS)


def _rotation(euler: Euler, signs: Euler) -> F64:
    """Ry Rx Rz of signed (yaw, pitch, roll)."""
    yaw, pitch, roll = np.multiply(euler, signs)
    about = matrix_from_rotvec(np.array([[0, yaw, 0], [pitch, 0, 0], [0, 0, roll]]))
    result: F64 = about[0] @ about[1] @ about[2]
    return result
