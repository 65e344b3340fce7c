"""Do clips move without gaps? Where frames are missing, a body jumps, or moves straight from one pose to another."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import F64, Avatar, Clip

FRAMES = 12  # fewer are not judged
BESIDE, AROUND = 3, 6  # frames on either side
FASTER = 2.2  # than all steps beside; captures give at most 1.9
ROUGHER = 2.5  # than all changes of speed around
LEAST, OF_ALL = 0.03, 0.05  # of a step: weights and entries of rotations; of the clip's widest motion
EVEN, MOVING = 0.02, 1e-3  # of a step's size, by which the next differs; the step of a pose that moves
RUN, LONGER = 6, 3  # even steps on end; times as long as the next run, and times in all other steps that move


def doubts(avatar: Avatar) -> list[Note]:
    """A doubt about each clip that jumps, or moves evenly between two of its frames and nowhere else."""
    found = {clip.name: (jumps(clip), even_run(clip)) for clip in avatar.clips}
    first = {name: [frame for frame in frames if frame is not None] for name, frames in found.items()}
    return [doubt("clip_gaps", clip=name, frame=frames[0]) for name, frames in first.items() if frames]


def jumps(clip: Clip) -> int | None:
    """The frame after which the pose jumps, although it is calm before and after."""
    if clip.frames < FRAMES:
        return None
    turns = clip.joint_delta[:, :, :3, :3].reshape(clip.frames, -1)
    pose = np.hstack([clip.expression_weights, clip.late_weights, turns]).astype(np.float64)
    step = np.diff(pose, axis=0)
    far, change = np.linalg.norm(step, axis=1), np.zeros(len(step))
    change[1:-1] = np.linalg.norm(step[1:-1] - (step[:-2] + step[2:]) / 2, axis=1)
    large = far > max(LEAST, OF_ALL * float(np.ptp(pose, axis=0).max(initial=0)))
    jump = large & (far > FASTER * _most(far, BESIDE, 1)) & (change > ROUGHER * _most(change, AROUND, 2))
    return _first(jump[2:-2], 2)


def even_run(clip: Clip) -> int | None:
    """The frame from which the pose moves as between two keys, in a clip that moves as captured elsewhere."""
    if clip.frames < FRAMES:
        return None
    turns = clip.joint_delta[:, :, :3, :3].astype(np.float64)
    turned = np.einsum("tjba,tjbc->tjac", turns[:-1], turns[1:]) - np.eye(3)
    weights = np.hstack([clip.expression_weights, clip.late_weights]).astype(np.float64)
    step = np.hstack([np.diff(weights, axis=0), turned.reshape(len(turned), -1)])
    far = np.linalg.norm(step, axis=1)
    far = np.minimum(far[1:], far[:-1])
    moves = far > MOVING
    even = moves & (np.linalg.norm(np.diff(step, axis=0), axis=1) < EVEN * far)
    edges = np.flatnonzero(np.diff(np.pad(even.astype(np.int64), 1)))
    first, length = edges[::2], edges[1::2] - edges[::2]
    if not len(length):
        return None
    second, longest = (int(one) for one in np.sort(np.append(length, 0))[-2:])
    others = np.count_nonzero(moves & ~even)
    alone = longest >= RUN and longest >= LONGER * second and others >= LONGER * longest
    return int(first[length.argmax()]) if alone else None


def _first(found: npt.NDArray[np.bool_], offset: int) -> int | None:
    return offset + int(found.argmax()) if found.any() else None


def _most(values: F64, reach: int, skipped: int) -> F64:
    """[T] the largest of `values` up to `reach` places before and after, but for the `skipped` nearest places."""
    padded = np.pad(values, reach)
    near = [np.roll(padded, shift) for shift in range(-reach, reach + 1) if abs(shift) >= skipped]
    most: F64 = np.max(near, axis=0)[reach : len(values) + reach]
    return most
