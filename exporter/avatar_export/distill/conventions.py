"""What the frames say of themselves: the order of quaternions, whether joints turn Gaussians, whether SH are turned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from avatar_export.distill import planes, weights
from avatar_export.distill.dumps.frames import Rows
from avatar_export.distill.learn import Task, sample_rows
from avatar_export.distill.sh_turn import turned_sh
from avatar_export.notes.note import Note, fact
from avatar_runtime.avatar import F32
from avatar_runtime.rotation import quat_multiply

CLEARER = 4.0  # times less variance over the frames, by which one reading is taken for the right one
STILLER = 1.5  # times less variance without the joints' turns, by which they do not turn Gaussians
NOISE = 1e-5  # variance that rounding and small changes cause
TURNED = 1e-3  # mean square of R - I of the sample's rotations, below which the numbers show no convention


def settled(task: Task, mended: list[Note]) -> Task:
    """`task` with the conventions that the numbers show; `mended` gets what dumps.json says otherwise."""
    if task.skeleton is None:
        return task
    sample = task.rows(sample_rows(task.layout.rows))
    assert task.motion is not None
    bound = weights.fit(task.motion, sample.mean[task.fitted])
    turn, _ = planes.blended(task.skeleton.skin_matrix, bound.weight)
    rotation = planes.rotations(turn)
    identity = np.eye(3, dtype=np.float32).reshape(9, 1)
    if float(np.square(rotation - identity).mean()) < TURNED:
        return task
    task = _quaternions(task, sample, rotation, mended)
    if task.turns and task.layout.sh_count > 1:
        task = _harmonics(task, sample, rotation, mended)
    return task


def _quaternions(task: Task, sample: Rows, rotation: F32, mended: list[Note]) -> Task:
    back = planes.quaternions(rotation) * np.array([1, -1, -1, -1], np.float32)
    own, other = sample.quat_wxyz, _reordered(task, sample.quat_wxyz)
    spread = {
        "turned": _spread(quat_multiply(back, own)),
        "still": _spread(own),
        "other": _spread(quat_multiply(back, other)),
    }
    least = min(spread["turned"], spread["still"])
    if spread["other"] + NOISE < (least + NOISE) / CLEARER:
        said = task.dumps.encoding.quaternion
        right = "xyzw" if said == "wxyz" else "wxyz"
        mended.append(fact("quaternion_order", right=right, stated=said))
        dumps = replace(task.dumps, encoding=replace(task.dumps.encoding, quaternion=right))
        return replace(task, dumps=dumps)
    return replace(task, turns=spread["turned"] + NOISE < STILLER * (spread["still"] + NOISE))


def _reordered(task: Task, quat: F32) -> F32:
    """The quaternions as if they had been read in the other order; right where no axes were turned."""
    return quat[..., [3, 0, 1, 2]] if task.dumps.encoding.quaternion == "wxyz" else quat[..., [1, 2, 3, 0]]


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
