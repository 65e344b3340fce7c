"""Drivers or joints that are some frames off against the frames: another shift predicts the Gaussians far better."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from avatar_export.distill.dumps.frames import Rows
from avatar_export.distill.learn import Task
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import F64, I64

MOST = 8  # frames that are tried each way
CLEARER = 0.5  # of the squared error: another shift must leave less
EXPLAINED = 0.3  # of the variance: the shift must leave less
LEAST = 1e-6  # squared error of all, in sizes of the figure: nothing to complain about
FEWEST, FRAMES = 24, 120  # that a shift is judged by
GAUSSIANS = 64
FOLDS = 4  # frames are predicted from those between
RIDGE = 1e-3
SHORT = 8  # frames: shorter takes are not judged
KINDS = (("drivers and joints", True, True), ("drivers", False, True), ("joints", True, False))


@dataclass(frozen=True)
class _Part:
    """What is judged as one: a take, or all short ones."""

    takes: tuple[int, ...]
    at: I64  # frames whose shifted ones lie in their takes, too
    most: int


def shift_doubts(task: Task, sample: Rows) -> list[Note]:
    """A doubt for each take whose Gaussians are predicted better by the drivers of some frames before or after."""
    drivers = task.dumps.drivers
    size = max(float(np.ptp(sample.mean[0], axis=0).max()), 1e-6)  # lengths are in sizes of the figure
    joints = np.zeros((drivers.frames, 0))
    if task.skeleton is not None:
        upper = task.skeleton.skin_matrix[:, :, :3].copy()
        upper[..., 3] /= size
        joints = upper.reshape(drivers.frames, -1)
    rows = np.unique(np.linspace(0, sample.mean.shape[1] - 1, GAUSSIANS).astype(int))
    places = sample.mean[:, rows].astype(np.float64).reshape(drivers.frames, -1) / size
    found = []
    for part in _parts(drivers.take):
        judged = _judged(part, joints, drivers.drivers, places)
        if judged is not None:
            which, shift, times = judged
            which = which if drivers.driver_names and task.skeleton is not None else "rows"
            names = [task.dumps.take_name(take) for take in part.takes]
            found.append(doubt("shifted", takes=names, which=which, shift=shift, times=times))
    return found


def _parts(take: I64) -> Iterator[_Part]:
    short: list[int] = []
    for kind in np.unique(take).tolist():
        at = np.flatnonzero(take == kind)
        if len(at) >= FEWEST + 2 * MOST:
            yield _part((kind,), [at], MOST)
        elif len(at) >= SHORT:
            short.append(kind)
    if short:
        members = [np.flatnonzero(take == kind) for kind in short]
        part = _part(tuple(short), members, min(MOST, min(map(len, members)) // 4))
        if len(part.at) >= FEWEST:
            yield part


def _part(takes: tuple[int, ...], members: list[I64], most: int) -> _Part:
    at = np.concatenate([frames[most : len(frames) - most] for frames in members])
    return _Part(takes, at[np.unique(np.linspace(0, len(at) - 1, min(len(at), FRAMES)).astype(int))], most)


def _judged(part: _Part, joints: F64, drivers: F64, places: F64) -> tuple[str, int, float] | None:
    """(what is shifted, by how many frames, how many times less is left) of the clearly better shift."""
    seen = places[part.at]
    varies = float(np.median(np.square(seen - seen.mean(axis=0)).sum(axis=1)))
    tried = []
    for which, with_joints, with_drivers in KINDS:
        if which == KINDS[0][0] or (joints.shape[1] and drivers.shape[1]):
            for shift in sorted(range(-part.most, part.most + 1), key=abs):
                j, d = part.at + with_joints * shift, part.at + with_drivers * shift
                tried.append((_left(np.concatenate([joints[j], drivers[d]], axis=1), seen), which, shift))
    now, best = tried[0][0], min(tried)
    if now < LEAST or not best[2] or best[0] > min(CLEARER * now, EXPLAINED * varies):
        return None
    return best[1], best[2], now / max(best[0], 1e-30)


def _left(columns: F64, places: F64) -> float:
    """The squared error of the median frame, predicted by ridge regression on the others."""
    columns = columns - columns.mean(axis=0)
    alike = columns @ columns.T
    alike += (RIDGE + 1e-9 * np.trace(alike) / len(alike)) * np.eye(len(alike))
    frames = np.arange(len(places))
    error = np.empty(len(places))
    for fold in range(FOLDS):
        out = frames % FOLDS == fold
        middle = places[~out].mean(axis=0)
        learnt = np.linalg.solve(alike[np.ix_(~out, ~out)], places[~out] - middle)
        guess = middle + alike[np.ix_(out, ~out)] @ learnt
        error[out] = np.square(places[out] - guess).sum(axis=1)
    return float(np.median(error))
