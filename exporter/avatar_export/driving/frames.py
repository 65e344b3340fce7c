"""A recorded take of a face: 61 channels a frame, whatever file it came from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from avatar_export.driving.arkit import ARKIT_NAMES, CHANNELS
from avatar_runtime.avatar import F64
from avatar_runtime.io.errors import AvatarError

Euler = tuple[float, float, float]

# Weights run from 0 to 1 and angles from -pi to pi; what lies beyond this is no channel of a face.
CHANNEL_LIMIT = 100.0


@dataclass(frozen=True)
class DrivingFrame:
    """One frame: `weights` by ARKit name and three Euler triples (yaw, pitch, roll) in radians.

    The angles are the recorder's channels as they stand; `axes` says which eye and which axis they mean.
    """

    time: float  # seconds from the start of the take
    weights: Mapping[str, float]
    head: Euler = (0.0, 0.0, 0.0)
    left_eye: Euler = (0.0, 0.0, 0.0)  # channels leftEye*
    right_eye: Euler = (0.0, 0.0, 0.0)  # channels rightEye*


@dataclass(frozen=True)
class DrivingTake:
    """A recording. `missing` names the channels that the file lacks (they are 0 in every frame)."""

    time: F64  # [F] seconds from the first frame, rising
    channels: F64  # [F, 61] in the order of arkit.CHANNELS
    fps: float  # frames a second, from the median step
    source: str
    missing: tuple[str, ...] = ()
    without_face: int = 0  # records that held no face, left out

    def __len__(self) -> int:
        return len(self.time)

    @property
    def frames(self) -> tuple[DrivingFrame, ...]:
        return tuple(self.frame(row) for row in range(len(self)))

    def frame(self, row: int) -> DrivingFrame:
        """Frame `row`; raises IndexError outside the take."""
        values = [float(v) for v in self.channels[row]]
        shapes = len(ARKIT_NAMES)
        head, left, right = (
            (values[at], values[at + 1], values[at + 2]) for at in range(shapes, len(CHANNELS), 3)
        )
        weights = dict(zip(ARKIT_NAMES, values[:shapes], strict=True))
        return DrivingFrame(float(self.time[row]), weights, head, left, right)


def take(
    time: F64, channels: F64, source: str, *, missing: tuple[str, ...] = (), without_face: int = 0
) -> DrivingTake:
    """A checked DrivingTake from absolute `time` [F] and `channels` [F, 61] in file order.

    Raises AvatarError for no frames, or a value that is not a finite number of a channel's size.
    """
    if len(time) == 0:
        raise AvatarError("holds no frame with a face", file=source)
    bad = ~(np.abs(channels) <= CHANNEL_LIMIT)
    if bad.any():
        row, column = (int(i) for i in np.argwhere(bad)[0])
        raise AvatarError(
            f"frame {row}: {channels[row, column]} is neither a weight nor an angle in radians",
            file=source,
            field=CHANNELS[column],
        )
    return DrivingTake(time - time[0], channels, frame_rate(time), source, missing, without_face)


def frame_rate(time: F64) -> float:
    """Frames a second from the median step of `time` [F] (seconds); 30 for a single frame.

    Within 8e-4 of a whole number it is that number: recorders' clocks drift (by 6.2e-4 in a real recording),
    and the nearest rate that is none, 29.97, is 1e-3 away from 30.
    """
    steps = np.diff(time)
    steps = steps[steps > 0]
    if len(steps) == 0:
        return 30.0
    rate = float(1 / np.median(steps))
    whole = round(rate)
    return float(whole) if whole and abs(rate / whole - 1) < 8e-4 else rate
