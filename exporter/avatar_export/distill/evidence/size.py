"""Units: is the figure as large as a human, and have skeleton and Gaussians one unit?"""

from __future__ import annotations

import numpy as np

from avatar_export.distill.drivers import FILE as DRIVERS
from avatar_export.distill.dumps.folder import DOCUMENT, OWNER
from avatar_export.distill.dumps.frames import Rows
from avatar_export.distill.learn import Task
from avatar_export.distill.weights import left_by_one
from avatar_export.fit.known import UNITS
from avatar_export.fit.skeleton import heights
from avatar_export.images import robust_box
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import F64
from avatar_runtime.io.errors import AvatarError

FRAMES = 64  # that are looked at
RIGID = 0.05  # of the Gaussians: so many follow a joint and little else
CLEARER = 2.0  # times less of their motion is left with lengths in the right unit
EXPLAINED, LITTLE = 0.5, 0.1  # of their motion: less must be left in the right unit, more in the stated one
LEAST = 1e-3  # of the figure: smaller motion is none
FACTORS = tuple(factor for value in UNITS for factor in (value, 1 / value))


def size_doubts(task: Task, sample: Rows) -> list[Note]:
    """A doubt about the size. Raises AvatarError where skeleton and Gaussians have different units."""
    at = task.fitted[np.unique(np.linspace(0, len(task.fitted) - 1, FRAMES).astype(int))]
    mean = sample.mean[at].astype(np.float64)
    if task.skeleton is not None:
        _refuse_other_unit(task, task.skeleton.skin_matrix[at], mean)
    size = float(np.median([np.ptp(robust_box(frame), axis=0).max() for frame in mean]))
    low, high = heights(None if task.skeleton is None else task.skeleton.count)
    if low <= size <= high:
        return []
    right, unit = _unit(size, low, high), task.dumps.unit
    then = None if right is None else size * right
    return [doubt("not_human", file=DOCUMENT, size=size, unit=unit, right=unit * (right or 1), then=then)]


def _unit(size: float, low: float, high: float) -> float | None:
    """The factor that makes `size` human: of centimetres or millimetres, else the one nearest to the middle."""
    fitting = [factor for factor in FACTORS if low <= size * factor <= high]
    middle = np.log(low * high) / 2
    return min(
        fitting,
        key=lambda f: (round(abs(np.log10(f)), 6) not in (2, 3), abs(np.log(size * f) - middle)),
        default=None,
    )


def _refuse_other_unit(task: Task, skin_matrix: F64, mean: F64) -> None:
    """Raise AvatarError where the joints explain the motion far better with their lengths in another unit."""
    moved = np.sqrt(np.square(mean - mean.mean(axis=0)).sum(axis=2).mean(axis=0))
    moved = np.maximum(moved, LEAST * float(np.ptp(mean[0], axis=0).max()) + 1e-9)
    most = np.argsort(moved)[len(moved) // 2 :]

    def left(factor: float) -> float:
        skin = skin_matrix.copy()
        skin[..., :3, 3] *= factor
        return float(np.quantile(left_by_one(skin, mean[:, most]) / moved[most], RIGID))

    now, best = left(1.0), min(FACTORS, key=left)
    if now > LITTLE and left(best) < min(EXPLAINED, now / CLEARER):
        raise AvatarError(
            f"has not the unit of the frames: times {best:.4g}, its lengths would explain how the Gaussians move; "
            f"multiply the translations of rest and world_from_joint by it, or look at unit in {DOCUMENT}",
            file=task.dumps.folder / DRIVERS,
            owner=OWNER,
        )
