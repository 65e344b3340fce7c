"""A recorded take of a face: 61 channels per frame, from any file format."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F64
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.driving.frame import DrivingFrame, frame_of
from avatar_runtime.io.errors import AvatarError

# Weights are in 0..1 and angles in -pi..pi; larger values are errors.
CHANNEL_LIMIT = 100.0


@dataclass(frozen=True)
class DrivingTake:
    """A recording. `missing` names the channels that the file lacks (they are 0 in every frame)."""

    time: F64  # [F] seconds from the first frame, increasing
    channels: F64  # [F, 61] in the order of arkit.CHANNELS
    fps: float  # frames per second, from the median step
    source: str
    missing: tuple[str, ...] = ()
    without_face: int = 0  # number of records without a face, which are left out

    def __len__(self) -> int:
        return len(self.time)

    @property
    def frames(self) -> tuple[DrivingFrame, ...]:
        """Every frame, in order."""
        return tuple(self.frame(row) for row in range(len(self)))

    def frame(self, row: int) -> DrivingFrame:
        """Frame `row`; raises IndexError outside the take."""
        return frame_of(float(self.time[row]), self.channels[row])


def take(
    time: F64, channels: F64, source: str, *, missing: tuple[str, ...] = (), without_face: int = 0
) -> DrivingTake:
    """A checked DrivingTake from absolute `time` [F] and `channels` [F, 61] in file order.

    Raises AvatarError without frames, and for a value that is not finite or too large for a channel.
    """
    if len(time) == 0:
        raise AvatarError("has no frame with a face", file=source)
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
    """Frames per second from the median step of `time` [F] (seconds); 30 for a single frame.

    A rate within 8e-4 of a whole number is rounded to it: clocks of recorders drift (by 6.2e-4 in a real recording),
    and the nearest fractional rate, 29.97, differs by 1e-3 from 30.
    """
    steps = np.diff(time)
    steps = steps[steps > 0]
    if len(steps) == 0:
        return 30.0
    rate = float(1 / np.median(steps))
    whole = round(rate)
    return float(whole) if whole and abs(rate / whole - 1) < 8e-4 else rate
