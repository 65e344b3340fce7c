"""Delta B_k of Gaussian Blendshapes, blended: constant init terms, and learned differences under a mask (Eq. 1, 2)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import torch
from numba import prange
from torch import Tensor

from avatar_runtime import F32, I64
from avatar_runtime.backends.cpu import kernel
from avatar_trainer.kernels import blend_cpu
from avatar_trainer.stages.blend import Deltas
from avatar_trainer.systems.gaussian_blendshapes.rows import Entries, Rows
from avatar_trainer.tensors import Gaussians


def with_init(base: Gaussians, rows: Rows, weights: Tensor) -> Gaussians:
    """base + sum_k w_k init_k, `weights` [K]; differentiable in `base`."""
    init = init_sum(rows, weights)
    return replace(base, mean=base.mean + init[:, :3], quat_wxyz=base.quat_wxyz + init[:, 3:])


def with_learned(
    base: Gaussians, entries: Entries, learned: Mapping[str, Tensor], mask: Tensor, weights: Tensor
) -> Gaussians:
    """base + sum_k w_k mask_k learned_k; differentiable in `base` and `learned`.

    `learned`: attribute -> [E', ...], `mask` [E'], `weights` [K].
    """
    # Every entry has its own column: the mask is then part of the weight, and is not multiplied with the values.
    own = torch.arange(entries.count)
    return blend_cpu(base, Deltas(entries.row_ptr, own, **learned), weights[entries.column] * mask)


def init_sum(rows: Rows, weights: Tensor) -> Tensor:
    """[N, 7] sum_k w_k init_k of position and quaternion."""
    result = torch.empty(rows.count, rows.init_values.shape[1])
    sum_rows(
        rows.init.row_ptr.numpy(),
        rows.init.column.numpy(),
        rows.init_values.numpy(),
        weights.numpy(),
        result.numpy(),
    )
    return result


@kernel(parallel=True)
def sum_rows(row_ptr: I64, column: I64, values: F32, weights: F32, out: F32) -> None:
    """out [N, W]: the weighted sum of each row's entries, in their order."""
    for row in prange(len(row_ptr) - 1):
        out[row] = 0
        for entry in range(row_ptr[row], row_ptr[row + 1]):
            weight = weights[column[entry]]
            if weight != 0:
                for k in range(values.shape[1]):
                    out[row, k] += weight * values[entry, k]


def turned_sum(sh: Tensor, init: Entries, turns: Tensor, weights: Tensor) -> Tensor:
    """[N, K, 3] sum_k w_k (D_k - 1) sh: the expressions' part of the SH [N, K, 3] for rule init_sh = rotated.

    `turns` [E, K, K] of the entries of `init`. Differentiable in `sh`.
    """
    row = init.row()
    added = turned_by_entry(sh, row, turns) * weights[init.column, None, None]
    return torch.zeros_like(sh).index_add(0, row, added)


def turned_by_entry(sh: Tensor, row: Tensor, turns: Tensor) -> Tensor:
    """(D_e - 1) sh of each entry's row, [E, K, 3]."""
    own = sh[row]
    return turns @ own - own
