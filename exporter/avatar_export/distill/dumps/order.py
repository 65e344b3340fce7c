"""Gaussians that change their places between frames: neighbours that part show it, looks say where they are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_export.distill.dumps.frames import Rows
from avatar_export.levels.neighbours import close_pairs
from avatar_runtime.avatar import F32, F64, I64

PARTED = 2.5  # times their first distance: a Gaussian so far from its neighbours may be another one
CERTAIN = 0.5  # the likest row must be that much likelier than the second
FEW = 0.02  # of the Gaussians: so many may be lost without doubt about the order, as where lips part
MANY = 0.1  # of the Gaussians: where so many are lost, all are looked for
MOST_CHANGES = 8
AT_ONCE = 1024
TINY = 1e-12


@dataclass(frozen=True)
class Neighbours:
    """Pairs of Gaussians that are near each other in the first frame."""

    pair: I64  # [P, 2]
    apart: F64  # [P] their distance then
    slack: float  # metres added to every distance: half the typical one
    count: F64  # [N] pairs of each Gaussian

    @staticmethod
    def of(mean: F32) -> Neighbours:
        """Of positions [N, 3]."""
        points = mean.astype(np.float64)
        pair = close_pairs(points, np.zeros(len(points), np.int64))
        apart = np.linalg.norm(points[pair[:, 0]] - points[pair[:, 1]], axis=1)
        near = apart <= np.median(apart) if len(apart) else np.zeros(0, bool)
        pair, apart = pair[near], apart[near]
        slack = 0.5 * float(np.median(apart)) if len(apart) else 0.0
        count = np.bincount(pair.reshape(-1), minlength=len(points)).astype(np.float64)
        return Neighbours(pair, apart, slack, count)

    def lost(self, mean: F32) -> I64:
        """Gaussians that have lost most of their neighbours at positions [N, 3]."""
        points = mean.astype(np.float64)
        now = np.linalg.norm(points[self.pair[:, 0]] - points[self.pair[:, 1]], axis=1)
        total, first = (
            np.bincount(self.pair.reshape(-1), np.repeat(length, 2), len(mean))
            for length in (now, self.apart)
        )
        return np.flatnonzero(total > PARTED * (first + self.slack * self.count))


@dataclass(frozen=True)
class Match:
    """Where the Gaussians of the last frame are in the next one."""

    order: I64 | None  # [N] row of the next frame for each Gaussian; None: nothing changed
    uncertain: int  # Gaussians whose row is not certain


def signature(rows: Rows) -> F32:
    """[N, 7] numbers of one frame that poses change little: colour, opacity, sizes."""
    return np.concatenate([rows.sh[0, :, 0], rows.opacity_logit[0, :, None], rows.log_scale[0]], axis=1)


def match(before: F32, after: F32, neighbours: Neighbours, mean: F32) -> Match:
    """The Gaussians with signatures `before` [N, c] among the rows with signatures `after` and positions `mean`.

    Only Gaussians that have lost their neighbours may have changed places, and those that took theirs. Rows that are
    certain by their looks are set aside first, so that the others have fewer to be confused with. The last few must lie
    among their neighbours.
    """
    lost, nothing = neighbours.lost(mean), Match(None, 0)
    if len(lost) < 2:
        return nothing
    if len(lost) > MANY * len(before):
        lost = np.arange(len(before))
    spread = np.maximum(before.std(axis=0), 1e-6).astype(np.float32)
    a, b = (before / spread)[lost], (after / spread)[lost]
    order = np.arange(len(before))
    own, other = np.arange(len(lost)), np.arange(len(lost))  # not matched yet
    while len(own):
        nearest, ratio = _nearest(a[own], b[other])
        back = _nearest(b[other], a[own])[0]
        sure = (back[nearest] == np.arange(len(own))) & (ratio < CERTAIN)
        if not sure.any():
            break
        order[lost[own[sure]]] = lost[other[nearest[sure]]]
        own, other = own[~sure], np.delete(other, nearest[sure])
    if 0 < len(own) <= MANY * len(before):
        own, other = _by_place(order, lost, own, other, neighbours, mean)
    if len(lost) <= FEW * len(before) and (len(own) or not _apart(a, b, order[lost], lost)):
        return nothing  # a mouth that opens, not another order
    order[lost[own]] = lost[other]
    moved = order != np.arange(len(order))
    return Match(order, len(own)) if len(own) or moved.any() else nothing


def _by_place(
    order: I64, lost: I64, own: I64, other: I64, neighbours: Neighbours, mean: F32
) -> tuple[I64, I64]:
    """What is left of `own` and `other` (indices into `lost`) once those next to their neighbours are in `order`."""
    known = np.ones(len(order), bool)
    known[lost[own]] = False
    pair = np.concatenate([neighbours.pair, neighbours.pair[:, ::-1]])
    pair = pair[known[pair[:, 1]]]
    count = np.bincount(pair[:, 0], minlength=len(order))
    at = mean[order[pair[:, 1]]]
    total = np.stack([np.bincount(pair[:, 0], at[:, axis], len(order)) for axis in range(3)], axis=1)
    middle = total / np.maximum(count, 1)[:, None]
    wanted = middle[lost[own]].astype(np.float32)
    nearest, ratio = _nearest(wanted, mean[lost[other]])
    back = _nearest(mean[lost[other]], wanted)[0]
    sure = (back[nearest] == np.arange(len(own))) & (ratio < CERTAIN) & (count[lost[own]] > 0)
    order[lost[own[sure]]] = lost[other[nearest[sure]]]
    return own[~sure], np.delete(other, nearest[sure])


def _apart(a: F32, b: F32, order: I64, lost: I64) -> bool:
    """Whether the new order explains the looks of the rows `lost` far better than the old one."""
    at = np.searchsorted(lost, order)
    return bool(np.square(a - b[at]).sum() < CERTAIN**2 * np.square(a - b).sum())


def _nearest(a: F32, b: F32) -> tuple[I64, F32]:
    """(row of `b` nearest to each row of `a`, its distance over that of the second nearest)."""
    if len(b) == 1:
        return np.zeros(len(a), np.int64), np.zeros(len(a), np.float32)
    found, ratio = np.empty(len(a), np.int64), np.empty(len(a), np.float32)
    square = np.square(b).sum(axis=1)
    for first in range(0, len(a), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        off = square - 2 * a[part] @ b.T + np.square(a[part]).sum(axis=1, keepdims=True)
        two = np.argpartition(off, 1, axis=1)[:, :2]
        value = np.sqrt(np.maximum(np.take_along_axis(off, two, axis=1), 0))
        found[part] = np.where(value[:, 0] > value[:, 1], two[:, 1], two[:, 0])
        ratio[part] = (value.min(axis=1) + TINY) / (value.max(axis=1) + TINY)
    return found, ratio
