"""What the frames say of themselves: the order of quaternions, whether joints turn Gaussians, whether SH are turned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from avatar_export.distill import planes, weights
from avatar_export.distill.dumps.frames import Rows
from avatar_export.distill.evidence.order import quaternion_order, reordered
from avatar_export.distill.learn import Task
from avatar_export.distill.sh_turn import turned_sh
from avatar_export.notes.note import Note, fact
from avatar_runtime.avatar import F32
from avatar_runtime.rotation import quat_multiply

CLEARER = 4.0  # times less variance over the frames, by which one reading is taken for the right one
STILLER = 1.5  # times less variance without the joints' turns, by which they do not turn Gaussians
NOISE = 1e-5  # variance that rounding and small changes cause
TURNED = 1e-3  # mean square of R - I of the sample's rotations, below which the numbers show no convention


def settled(task: Task, sample: Rows, mended: list[Note], doubts: list[Note]) -> Task:
    """`task` with the conventions that the numbers show; `mended` gets what dumps.json says otherwise.

    `sample` are the Gaussians of `sample_rows` in all frames.
    """
    stated, task = task, quaternion_order(task, mended, doubts)
    if task is not stated:
        sample = replace(sample, quat_wxyz=reordered(stated.dumps, sample.quat_wxyz))
    rotation = _joints_turn(task, sample)
    if rotation is None:
        return task
    back = planes.quaternions(rotation) * np.array([1, -1, -1, -1], np.float32)
    turned, still = _spread(quat_multiply(back, sample.quat_wxyz)), _spread(sample.quat_wxyz)
    task = replace(task, turns=turned + NOISE < STILLER * (still + NOISE))
    if task.turns and task.layout.sh_count > 1:
        task = _harmonics(task, sample, rotation, mended)
    return task


def _joints_turn(task: Task, sample: Rows) -> F32 | None:
    """[F, 9, n] how the joints turn the sample; None where they say nothing."""
    if task.skeleton is None or task.motion is None:
        return None
    bound = weights.fit(task.motion, sample.mean[task.fitted])
    turn, _ = planes.blended(task.skeleton.skin_matrix, bound.weight)
    rotation = planes.rotations(turn)
    identity = np.eye(3, dtype=np.float32).reshape(9, 1)
    return rotation if float(np.square(rotation - identity).mean()) >= TURNED else None


def _harmonics(task: Task, sample: Rows, rotation: F32, mended: list[Note]) -> Task:
    said = task.dumps.encoding.sh
    if said != "rotated":
        return task
    higher = float(sample.sh[:, :, 1:].var(axis=0).mean())
    back = turned_sh(sample.sh, planes.matrices(rotation).swapaxes(-1, -2))
    unturned = float(back[:, :, 1:].var(axis=0).mean())
    if higher + NOISE**2 < (unturned + NOISE**2) / CLEARER:
        mended.append(fact("unrotated_sh"))
        return replace(task, dumps=replace(task.dumps, encoding=replace(task.dumps.encoding, sh="unrotated")))
    return task


def _spread(quat: F32) -> float:
    """Mean variance over the frames of unit quaternions [F, n, 4], of either sign."""
    return float(planes.aligned(quat).var(axis=0, dtype=np.float64).mean())
