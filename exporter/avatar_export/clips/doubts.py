"""What a user should know of a recording or clip, and of ARKit names, for one avatar."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from avatar_export.driving.drive import unreached
from avatar_export.driving.frames import DrivingTake
from avatar_export.measure.poses import movable
from avatar_export.notes.note import Note, doubt, fact
from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.driving.arkit import ARKIT_NAMES, ROTATION_CHANNELS
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.pose import resolve

PERCENT = 5.0  # nobody exaggerates a shape so far; a blink in percent is above
GAP, GAP_FRAMES = 0.25, 3.0  # seconds and usual steps: a longer step between two frames is a gap
MEASURED = (1e-3, 0.0, 0.0)  # the angles of an eye that was measured; zeros mean that it was not


def take_notes(avatar: Avatar, take: DrivingTake) -> list[Note]:
    """What a user should know of a take that drives `avatar`: what looks wrong, then names that are not in both."""
    weights, angles = take.channels[:, : len(ARKIT_NAMES)], take.channels[:, len(ARKIT_NAMES) :]
    found = [
        *too_far("percent", PERCENT, take.source, ARKIT_NAMES, weights),
        *too_far("degrees", np.pi, take.source, ROTATION_CHANNELS, angles),
    ]
    steps = np.diff(take.time)
    gaps = np.flatnonzero(steps > max(GAP, GAP_FRAMES / take.fps))
    if len(gaps):
        first, lost = int(gaps[0]), float((steps[gaps] - 1 / take.fps).sum())
        after, at = float(take.time[first]), float(steps[first])
        found.append(doubt("gaps", file=take.source, count=len(gaps), after=after, step=at, lost=lost))
    if take.without_face:
        found.append(fact("without_face", file=take.source, count=take.without_face))
    eyes = any("Eye" in name for name in ROTATION_CHANNELS if name not in take.missing)
    lacking = [name for name in ARKIT_NAMES if name in take.missing]
    still = unmoved(avatar, lacking, eyes=eyes)
    if lost_names := [name for name in lacking if name not in still]:
        found.append(fact("names_missing", file=take.source, of=len(ARKIT_NAMES), names=lost_names))
    if unused := unreached(avatar):
        found.append(fact("channels_unused", count=len(ARKIT_NAMES), names=unused))
    return found


def too_far(kind: str, limit: float, what: str, names: Sequence[str], values: F32 | F64) -> list[Note]:
    """A doubt of a kind, with the largest of the `values` [F, K] of `names`, if it is beyond the limit."""
    far = np.abs(values)
    if far.max(initial=0) <= limit:
        return []
    frame, column = (int(i) for i in np.unravel_index(np.argmax(far), far.shape))
    return [doubt(kind, what=what, name=names[column], value=float(values[frame, column]), frame=frame)]


def unmoved(avatar: Avatar, names: Iterable[str], *, eyes: bool = False) -> list[str]:
    """Those ARKit `names` that move nothing at all of this avatar; `eyes`: where the rotations of eyes are measured.

    Raises AvatarError if ARKit cannot drive it.
    """
    driver, look = Driver(avatar), MEASURED if eyes else (0.0, 0.0, 0.0)
    shown = movable(avatar)  # some rigs have shapes that change nothing

    def posed(weights: dict[str, float]) -> list[F64 | F32]:
        arrays = resolve(driver.pose(DrivingFrame(0.0, weights, left_eye=look, right_eye=look)), avatar)
        return [arrays.expression_weights[shown], arrays.late_weights, arrays.joint_delta]

    rest = posed({})
    return [name for name in names if all(map(np.array_equal, posed({name: 1.0}), rest))]
