"""Weighted sums over the entries of a `SparseRows`, for stages morph, skin, blend and bind."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, SparseRows


def combine(sparse: SparseRows, weights: F32) -> dict[str, F32]:
    """Per attribute, [R, ...]: the sum over a row's entries of weights[column] * value.

    Entries of zero weight are not read. NumPy fixes the order of addition inside a row, so results repeat.
    """
    active = weights[sparse.column] != 0
    entry = np.flatnonzero(active)
    ptr = np.concatenate([[0], np.cumsum(active)])[sparse.row_ptr]
    weight = weights[sparse.column[entry]]
    return {name: _sum_rows(value[entry], weight, ptr) for name, value in sparse.values.items()}


def gather(sparse: SparseRows, table: npt.NDArray[np.float32]) -> F32:
    """[R, ...]: the sum over a row's entries of weight * table[column], for skin weights."""
    weight = sparse.values["weight"]
    return _sum_rows(table[sparse.column], weight, sparse.row_ptr.astype(np.int64))


def _sum_rows(values: F32, weight: F32, ptr: npt.NDArray[Any]) -> F32:
    shape = (len(ptr) - 1, *values.shape[1:])
    out = np.zeros(shape, np.float32)
    filled = np.flatnonzero(ptr[1:] > ptr[:-1])
    if len(filled):
        weighted = values.reshape(len(values), -1) * weight[:, None]
        out.reshape(shape[0], -1)[filled] = np.add.reduceat(weighted, ptr[filled], axis=0)
    return out
