"""Ridge regression in natural units: what the drivers and the joints' turns do to each number of a Gaussian."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I64

RIDGES = (1e-7, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)  # tried, of drivers and of turns
FIRST = 0.1  # of the turns, while that of the drivers is chosen
MOST_KINDS = 12  # masks, the commonest, that the ridges are chosen with
CORRECTED = 0.01  # weight of a joint above which its turns may correct a Gaussian

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Columns:
    """What a number may depend on, frame by frame: one, the exercised drivers, and the turns of some joints."""

    drivers: F64  # [F, D]
    turns: F64  # [F, C, 9] R - I

    def of(self, joints: Sequence[int]) -> F64:
        """[F, 1 + D + 9 c] with the turns of the given joints (indices into C)."""
        frames = len(self.drivers)
        parts = [np.ones((frames, 1)), self.drivers, self.turns[:, list(joints)].reshape(frames, -1)]
        return np.concatenate(parts, axis=1)

    def penalty(self, joints: Sequence[int], ridge: tuple[float, float]) -> F64:
        """[1 + D + 9 c] the ridge of each column; the constant has none."""
        return np.array(
            [0.0, *[ridge[0]] * self.drivers.shape[1], *[ridge[1]] * (9 * len(joints))], np.float64
        )

    def at(self, frames: I64) -> Columns:
        """The given frames."""
        return Columns(self.drivers[frames], self.turns[frames])


def ridge_solve(columns: F64, penalty: F64, values: F32) -> F32:
    """[P, M] coefficients of `columns` [F, P] for `values` [F, M], each column with its ridge."""
    middle = values.mean(axis=0)
    square = columns.T @ columns + np.diag(penalty)
    solver = np.linalg.solve(square, columns.T).astype(np.float32)  # [P, F]
    found: F32 = solver @ (values - middle)
    found[0] += middle
    return found


def fit_groups(
    columns: Columns, masks: Mask, values: F32, ridge: tuple[float, float]
) -> tuple[F32, F32, F32]:
    """(constant [n, c], drivers [n, D, c], turns [n, C, 9, c]) for values [F, n, c].

    Gaussians with the same mask (joints that may correct them) are solved together.
    """
    frames, count, channels = values.shape
    drivers, joints = columns.drivers.shape[1], columns.turns.shape[1]
    constant = np.empty((count, channels), np.float32)
    driven = np.empty((count, drivers, channels), np.float32)
    turned = np.zeros((count, joints, 9, channels), np.float32)
    for rows, used in groups(masks, joints):
        part = values if len(rows) == count else values[:, rows]
        found = ridge_solve(columns.of(used), columns.penalty(used, ridge), part.reshape(frames, -1))
        found = found.reshape(len(found), len(rows), channels)
        constant[rows] = found[0]
        driven[rows] = found[1 : 1 + drivers].transpose(1, 0, 2)
        if used:
            corrected = found[1 + drivers :].reshape(len(used), 9, len(rows), channels)
            turned[np.ix_(rows, np.array(used))] = corrected.transpose(2, 0, 1, 3)
    return constant, driven, turned


def groups(masks: Mask, joints: int) -> list[tuple[I64, list[int]]]:
    """(rows, joints of their mask) of every mask that occurs."""
    packed = np.packbits(masks, axis=1) if joints else np.zeros((len(masks), 1), np.uint8)
    kinds, member = np.unique(packed, axis=0, return_inverse=True)
    member = member.reshape(-1)
    order = np.argsort(member, kind="stable")
    rows = np.split(order, np.cumsum(np.bincount(member, minlength=len(kinds)))[:-1])
    return [(part, np.flatnonzero(masks[part[0]]).tolist()) for part in rows]


def masks_of(weight: F64, turning: I64) -> Mask:
    """[n, C] which of the turning joints have a weight that counts."""
    result: Mask = weight[:, turning] > CORRECTED
    return result


def folds(take: I64, most: int = 5) -> list[I64]:
    """Frames of each fold: whole takes where there are enough, else blocks of neighbours."""
    kinds = np.unique(take)
    if len(kinds) >= most:
        return [np.flatnonzero(np.isin(take, kinds[k::most])) for k in range(most)]
    return [part for part in np.array_split(np.arange(len(take)), most) if len(part)]


def choose_ridge(columns: Columns, masks: Mask, values: F32, take: I64) -> tuple[float, float]:
    """The ridges (of drivers, of turns) with the least error on blocks that were left out; values [F, n, c].

    The ridge of the drivers is chosen first, then that of the turns.
    """
    common = sorted(groups(masks, masks.shape[1]), key=lambda group: -len(group[0]))[:MOST_KINDS]
    parts = folds(take)

    def cost(ridge: tuple[float, float]) -> float:
        return _left_out(columns, common, values, parts, ridge)

    drivers, turns = RIDGES[0], FIRST
    if columns.drivers.shape[1]:
        drivers = min(RIDGES, key=lambda ridge: cost((ridge, FIRST)))
    if masks.any():
        turns = min(RIDGES, key=lambda ridge: cost((drivers, ridge)))
    return drivers, turns


def _left_out(
    columns: Columns,
    kinds: list[tuple[I64, list[int]]],
    values: F32,
    parts: list[I64],
    ridge: tuple[float, float],
) -> float:
    """Sum of squared errors on each of the blocks of frames `parts`, fitted to the others."""
    total = 0.0
    for rows, used in kinds:
        every, penalty = columns.of(used), columns.penalty(used, ridge)
        part = np.ascontiguousarray(values[:, rows]).reshape(len(values), -1)
        for left_out in parts:
            kept = np.setdiff1d(np.arange(len(values)), left_out)
            off = part[left_out] - every[left_out].astype(np.float32) @ ridge_solve(
                every[kept], penalty, part[kept]
            )
            total += float(np.square(off, dtype=np.float64).sum())
    return total
