"""One frame of captured face motion: weights by ARKit name, rotations of head and eyes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS

Euler = tuple[float, float, float]


@dataclass(frozen=True)
class DrivingFrame:
    """One frame: `weights` by ARKit name and three Euler triples (yaw, pitch, roll) in radians.

    The angles are the recorder's channels, unchanged; `axes` says which eye and axis they mean.
    """

    time: float  # seconds from the start of the take
    weights: Mapping[str, float]
    head: Euler = (0.0, 0.0, 0.0)
    left_eye: Euler = (0.0, 0.0, 0.0)  # channels leftEye*
    right_eye: Euler = (0.0, 0.0, 0.0)  # channels rightEye*


def frame_of(time: float, channels: Iterable[float]) -> DrivingFrame:
    """The frame of all 61 channels, in the order of arkit.CHANNELS."""
    values = [float(value) for value in channels]
    shapes = len(ARKIT_NAMES)
    head, left, right = (
        (values[at], values[at + 1], values[at + 2]) for at in range(shapes, len(CHANNELS), 3)
    )
    return DrivingFrame(time, dict(zip(ARKIT_NAMES, values[:shapes], strict=True)), head, left, right)
