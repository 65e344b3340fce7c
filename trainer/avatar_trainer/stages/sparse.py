"""Weighted sums over the entries of a sparse matrix stored by row; twins of `avatar_runtime.stages.sparse`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import SparseRows


@dataclass(frozen=True)
class Entries:
    """One attribute of a `SparseRows` as tensors."""

    row: Tensor  # [E] int64, rising
    column: Tensor  # [E] int64
    values: Tensor  # [E, ...]
    rows: int

    @staticmethod
    def of(sparse: SparseRows, attribute: str, dtype: torch.dtype) -> Entries:
        """The entries of `attribute`."""
        ptr = sparse.row_ptr.astype(np.int64)
        return Entries(
            torch.from_numpy(np.repeat(np.arange(sparse.rows), ptr[1:] - ptr[:-1])),
            torch.from_numpy(sparse.column.astype(np.int64)),
            torch.from_numpy(sparse.values[attribute].copy()).to(dtype),
            sparse.rows,
        )


def combine(entries: Entries, weights: Tensor) -> Tensor:
    """[R, ...]: the sum over a row's entries of weights[column] * value; differentiable in both."""
    return _sum_rows(entries, weights[entries.column], entries.values)


def gather(entries: Entries, table: Tensor) -> Tensor:
    """[R, ...]: the sum over a row's entries of value * table[column], for skin weights."""
    return _sum_rows(entries, entries.values, table[entries.column])


def _sum_rows(entries: Entries, weight: Tensor, values: Tensor) -> Tensor:
    weighted = values * weight.reshape(-1, *[1] * (values.dim() - 1))
    total = weighted.new_zeros((entries.rows, *values.shape[1:]))
    return total.index_add(0, entries.row, weighted)
