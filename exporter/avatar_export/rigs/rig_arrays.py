"""SparseRows of a rig from lists of entries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I64, SparseRows

# Weights whose sum is this near 1 are not changed: it is the rounding of float32 and of 8 or 16 bits.
WEIGHT_SUM_TOLERANCE = 1e-5


def by_row(
    row: npt.NDArray[Any], column: npt.NDArray[Any], values: Mapping[str, F32], rows: int, columns: int
) -> SparseRows:
    """SparseRows from entries in any order, without duplicate (row, column)."""
    order = np.lexsort((column, row))
    ptr = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=rows))]).astype(np.uint32)
    sorted_values = {name: value[order] for name, value in values.items()}
    return SparseRows(ptr, column[order].astype(np.uint16), sorted_values, columns)


def unit_weights(row: I64, column: I64, weight: F64, rows: int, columns: int) -> tuple[SparseRows, F64, int]:
    """(skin weights, sum of each row as given [rows], rows divided by a sum that was not 1).

    Several weights of one joint at one vertex are added; zero weights are dropped.
    """
    key, inverse = np.unique(row * columns + column, return_inverse=True)
    summed = np.bincount(inverse, weight, len(key))
    row, column = (part[summed > 0] for part in (key // columns, key % columns))
    summed = summed[summed > 0]
    total: F64 = np.bincount(row, summed, rows).astype(np.float64)
    off = np.abs(total - 1) > WEIGHT_SUM_TOLERANCE
    summed = np.where(off[row], summed / total[row], summed)
    entries = by_row(row, column, {"weight": summed.astype(np.float32)}, rows, columns)
    return entries, total, int(np.count_nonzero(off))
