"""Samples of an avatar's Gaussians: rows spread over all, their neighbours, shares of values."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F64, I64, Avatar

FEWEST = 64  # Gaussians of an avatar that is judged
ASKED = 400  # rows whose neighbours are looked for
AMONG = 20_000  # rows among which they are looked for

Floats = npt.NDArray[Any]
Bools = npt.NDArray[np.bool_]


def spread_rows(count: int, most: int) -> I64:
    """At most `most` of the rows 0 to `count`, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(most, count)).astype(np.int64))


def unit_rows(values: Floats) -> F64:
    """[n, C] `values` over their lengths."""
    rows = values.astype(np.float64)
    unit: F64 = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-30)
    return unit


def between(values: Floats, low: float, high: float) -> float:
    """The share of `values` from `low` to `high`."""
    return float(((values >= low) & (values <= high)).mean()) if values.size else 0.0


def neighbours(avatar: Avatar, rows: I64, others: I64, count: int) -> tuple[I64, I64]:
    """(some of `rows` [Q], the `count` nearest of `others` to each, itself left out [Q, count]); none of too few."""
    if not len(rows) or len(others) <= 2 * count:
        return np.zeros(0, np.int64), np.zeros((0, count), np.int64)
    picked, among = rows[spread_rows(len(rows), ASKED)], others[spread_rows(len(others), AMONG)]
    places = avatar.gaussians.mean[among]
    middle = places.mean(axis=0)
    places, own = places - middle, avatar.gaussians.mean[picked] - middle
    away = np.square(places).sum(axis=1) - 2 * own @ places.T
    away[picked[:, None] == among] = np.inf
    return picked, among[np.argpartition(away, count, axis=1)[:, :count]]
