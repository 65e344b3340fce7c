"""Learns the numbers of an avatar on a skeleton, block by block of its Gaussians."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from avatar_export.distill import planes, weights
from avatar_export.distill.dumps.folder import Dumps
from avatar_export.distill.dumps.frames import Layout, Rows, read_rows
from avatar_export.distill.sh_turn import turned_sh
from avatar_export.distill.skeleton import Skeleton, exercised
from avatar_export.distill.solve import Columns, choose_ridge, fit_groups, masks_of
from avatar_runtime.avatar import F32, F64, I64
from avatar_runtime.rotation import quat_multiply

BLOCK_BYTES = 48 << 20  # of the decoded numbers of one block
SAMPLE = 512  # Gaussians with which ridges are chosen
ATTRIBUTES = ("mean", "quat_wxyz", "log_scale", "opacity_logit", "sh")
Ridges = Mapping[str, tuple[float, float]]
Array = np.ndarray


@dataclass(frozen=True)
class Still:
    """Rows of Gaussians with the skeleton's motion taken out, and how they hang on it."""

    bound: weights.Bound | None  # None without a skeleton
    values: Mapping[str, F32]  # attribute -> [F, n, ...]


@dataclass(frozen=True)
class Task:
    """What all blocks share."""

    dumps: Dumps
    layout: Layout
    fitted: I64  # frames that are learnt from
    skeleton: Skeleton | None
    motion: weights.Motion | None  # of the fitted frames
    columns: Columns  # of all frames
    active: I64  # drivers that were exercised
    turns: bool = True  # whether the skeleton rotates the Gaussians
    order: I64 | None = None  # [F, N] where rows changed their places

    @property
    def sh_turns(self) -> bool:
        """Whether the SH of the frames turn with the Gaussians, so that they must be turned back."""
        return self.turns and self.dumps.encoding.sh == "rotated" and self.layout.sh_count > 1

    @property
    def sh_direction(self) -> str:
        """The rule by which the avatar's SH are seen."""
        return "world" if self.dumps.encoding.sh == "fixed" or not self.turns else "inverse_rotation"

    @staticmethod
    def of(
        dumps: Dumps,
        layout: Layout,
        fitted: I64,
        skeleton: Skeleton | None,
        order: I64 | None = None,
        turns: bool = True,
    ) -> Task:
        """The task of learning from the frames `fitted`."""
        active = exercised(dumps.drivers, fitted)
        values = dumps.drivers.drivers[:, active]
        frames = len(values)
        turned = np.zeros((frames, 0, 9)) if skeleton is None else skeleton.features()
        motion = None
        if skeleton is not None:
            motion = weights.Motion.of(skeleton.skin_matrix[fitted], values[fitted], skeleton.leader)
        return Task(dumps, layout, fitted, skeleton, motion, Columns(values, turned), active, turns, order)

    def rows(self, which: slice | I64) -> Rows:
        """The given Gaussians in all frames."""
        return read_rows(self.dumps, self.layout, which, self.order)

    def blocks(self) -> list[slice]:
        """Runs of Gaussians that fit into memory together."""
        numbers = 11 + 3 * self.layout.sh_count
        step = max(64, BLOCK_BYTES // (4 * numbers * self.dumps.drivers.frames))
        return [slice(k, min(k + step, self.layout.rows)) for k in range(0, self.layout.rows, step)]


def still(task: Task, rows: Rows, prior: F64 | None = None) -> Still:
    """`rows` unposed: positions and rotations in the binding pose, one sign a quaternion, SH turned back."""
    if task.motion is None or task.skeleton is None:
        return Still(None, _plain(rows, rows.mean, planes.aligned(rows.quat_wxyz), rows.sh))
    bound = weights.fit(task.motion, rows.mean[task.fitted], prior)
    turn, move = planes.blended(task.skeleton.skin_matrix, bound.weight)
    mean = planes.unmoved(turn, move, rows.mean)
    if not task.turns:
        return Still(bound, _plain(rows, mean, planes.aligned(rows.quat_wxyz), rows.sh))
    rotation = planes.rotations(turn)
    back = planes.quaternions(rotation) * np.array([1, -1, -1, -1], np.float32)
    quat = planes.aligned(quat_multiply(back, rows.quat_wxyz))
    sh = rows.sh
    if task.sh_turns:
        sh = turned_sh(sh, planes.matrices(rotation).swapaxes(-1, -2))
    return Still(bound, _plain(rows, mean, quat, sh))


def _plain(rows: Rows, mean: F32, quat: F32, sh: F32) -> dict[str, F32]:
    return {
        "mean": mean,
        "quat_wxyz": quat,
        "log_scale": rows.log_scale,
        "opacity_logit": rows.opacity_logit[..., None],
        "sh": sh.reshape(*sh.shape[:2], -1),
    }


def ridges(task: Task, sample: Still, names: Sequence[str] = ATTRIBUTES) -> dict[str, tuple[float, float]]:
    """The ridge of each attribute, chosen on a `sample` of the Gaussians; only positions follow the joints' turns."""
    at, take = task.fitted, task.dumps.drivers.take[task.fitted]
    count = sample.values["sh"].shape[1]
    masks = _masks(task, sample, count)
    result = {}
    for name in names:
        used = masks if name == "mean" else np.zeros_like(masks)
        result[name] = choose_ridge(task.columns.at(at), used, sample.values[name][at], take)
    return result


def sample_rows(count: int) -> I64:
    """Evenly spaced Gaussians."""
    return np.unique(np.linspace(0, count - 1, min(count, SAMPLE)).astype(np.int64))


def _masks(task: Task, block: Still, count: int) -> Array:
    if block.bound is None or task.skeleton is None:
        return np.zeros((count, 0), bool)
    return masks_of(block.bound.weight, task.skeleton.turning)


@dataclass(frozen=True)
class Fitted:
    """Coefficients of some Gaussians."""

    bound: weights.Bound | None
    constant: Mapping[str, F32]  # attribute -> [n, c]
    driven: Mapping[str, F32]  # attribute -> [n, D active, c]
    turned: F32  # [n, C, 9, 3] of the means


def fit_block(task: Task, block: Still, ridge: Ridges) -> Fitted:
    """The coefficients of a block."""
    columns = task.columns.at(task.fitted)
    count = block.values["mean"].shape[1]
    masks = _masks(task, block, count)
    constant, driven = {}, {}
    turned = np.zeros((count, masks.shape[1], 9, 3), np.float32)
    for name in ATTRIBUTES:
        used = masks if name == "mean" else np.zeros_like(masks)
        constant[name], driven[name], corrected = fit_groups(
            columns, used, block.values[name][task.fitted], ridge[name]
        )
        turned = corrected if name == "mean" else turned
    return Fitted(block.bound, constant, driven, turned)


def learn(
    task: Task,
    take: Callable[[slice, Still, Fitted], None],
    priors: Callable[[slice | I64], F64 | None] = lambda _: None,
    progress: Callable[[str], None] = lambda _: None,
) -> Ridges:
    """Fit every block and hand it to `take`; returns the ridges that were chosen."""
    progress("choosing ridges")
    rows = sample_rows(task.layout.rows)
    ridge = ridges(task, still(task, task.rows(rows), priors(rows)))
    for block in task.blocks():
        progress(f"Gaussians {block.start} to {block.stop} of {task.layout.rows}")
        unposed = still(task, task.rows(block), priors(block))
        take(block, unposed, fit_block(task, unposed, ridge))
    return ridge
