"""Stage `blend`: the values and gradients of `stages.blend.blend`."""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, I64
from avatar_runtime.backends.cpu import inlined, kernel
from avatar_trainer.kernels.arrays import plain
from avatar_trainer.stages.blend import Deltas
from avatar_trainer.tensors import Gaussians

ZERO = np.float32(0)


class Values(NamedTuple):
    """Every attribute of some Gaussians or of some deltas, a row each."""

    mean: F32  # [R, 3]
    log_scale: F32  # [R, 3]
    quat_wxyz: F32  # [R, 4]
    opacity_logit: F32  # [R]
    sh: F32  # [R, 3 K]


def blend_cpu(base: Gaussians, deltas: Deltas, expression_weights: Tensor) -> Gaussians:
    """As `stages.blend.blend`, float32; differentiable in the base and the deltas.

    Entries of zero weight are not read, and their gradient is 0. Raises ValueError if a tensor is not float32 on the
    CPU, if `expression_weights` [Kx] need a gradient, and if the deltas do not fit the base.
    """
    if expression_weights.requires_grad:
        raise ValueError("blend_cpu has no gradient for the expression weights; stages.blend.blend has")
    _check_pattern(deltas, len(base.mean), len(expression_weights))
    blended: tuple[Tensor, ...] = _Blend.apply(  # type: ignore[no-untyped-call]
        deltas.row_ptr,
        deltas.column,
        expression_weights,
        *(getattr(base, name) for name in Values._fields),
        *(getattr(deltas, name) for name in Values._fields),
    )
    return Gaussians(**dict(zip(Values._fields, blended, strict=True)))


class _Blend(torch.autograd.Function):
    """Inputs: row_ptr, column, weights, the five of the base, the five of the deltas."""

    @staticmethod
    def forward(
        ctx: Any, row_ptr: Tensor, column: Tensor, weights: Tensor, *values: Tensor
    ) -> tuple[Tensor, ...]:
        base, delta = values[:5], values[5:]
        out = tuple(torch.empty(value.shape) for value in base)
        ctx.pattern = (row_ptr.numpy(), column.numpy(), plain(weights, len(weights)))
        ctx.shapes = [value.shape for value in delta]
        coefficients = base[4].shape[1]
        arrays = (_values(group, coefficients) for group in (base, delta, out))
        _add_rows(*ctx.pattern, *arrays)
        return out

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        if not any(ctx.needs_input_grad[8:]):
            return None, None, None, *gradients, *(None,) * 5
        grad_delta = tuple(torch.empty(shape) for shape in ctx.shapes)
        coefficients = gradients[4].shape[1]
        row_ptr, column, weights = ctx.pattern
        grad_rows, grad_entries = (_values(group, coefficients) for group in (gradients, grad_delta))
        _spread_rows(row_ptr, column, weights, grad_rows, grad_entries)
        return None, None, None, *gradients, *grad_delta


def _values(tensors: tuple[Tensor, ...], coefficients: int) -> Values:
    rows = len(tensors[0])
    shapes = ((rows, 3), (rows, 3), (rows, 4), (rows,), (rows, 3 * coefficients))
    return Values(*(plain(tensor, *shape) for tensor, shape in zip(tensors, shapes, strict=True)))


def _check_pattern(deltas: Deltas, rows: int, columns: int) -> None:
    ptr, column = deltas.row_ptr, deltas.column
    if any(index.dtype != torch.int64 or not index.is_contiguous() for index in (ptr, column)):
        raise ValueError("row_ptr and column are contiguous int64")
    if ptr.shape != (rows + 1,) or ptr[0] != 0 or ptr[-1] != len(column) or bool((ptr.diff() < 0).any()):
        raise ValueError(f"row_ptr does not rise from 0 to the {len(column)} entries in {rows} rows")
    if len(column) and not 0 <= int(column.min()) <= int(column.max()) < columns:
        raise ValueError(f"column points outside the {columns} expression weights")
    if any(len(getattr(deltas, name)) != len(column) for name in Values._fields):
        raise ValueError(f"the deltas do not have {len(column)} entries each")


# A parallel loop writes in a separate function, since Numba treats a write into a tuple's array as dead code.


@kernel(parallel=True)
def _add_rows(row_ptr: I64, column: I64, weights: F32, base: Values, delta: Values, out: Values) -> None:
    """Of row_ptr [N + 1], column [E], weights [Kx]: `out` is base + sum_k w_k delta_k."""
    for i in numba.prange(len(base.mean)):
        _add_row(i, row_ptr, column, weights, base, delta, out)


@kernel(parallel=True)
def _spread_rows(row_ptr: I64, column: I64, weights: F32, gradient: Values, out: Values) -> None:
    """`gradient` of the rows becomes that of the entries, in `out`."""
    for i in numba.prange(len(gradient.mean)):
        _spread_row(i, row_ptr, column, weights, gradient, out)


@inlined
def _add_row(
    i: int, row_ptr: I64, column: I64, weights: F32, base: Values, delta: Values, out: Values
) -> None:
    width = base.sh.shape[1]
    for k in range(3):
        out.mean[i, k] = base.mean[i, k]
        out.log_scale[i, k] = base.log_scale[i, k]
    for k in range(4):
        out.quat_wxyz[i, k] = base.quat_wxyz[i, k]
    out.opacity_logit[i] = base.opacity_logit[i]
    for k in range(width):
        out.sh[i, k] = base.sh[i, k]
    for e in range(row_ptr[i], row_ptr[i + 1]):
        w = weights[column[e]]
        if w != ZERO:
            for k in range(3):
                out.mean[i, k] += delta.mean[e, k] * w
                out.log_scale[i, k] += delta.log_scale[e, k] * w
            for k in range(4):
                out.quat_wxyz[i, k] += delta.quat_wxyz[e, k] * w
            out.opacity_logit[i] += delta.opacity_logit[e] * w
            for k in range(width):
                out.sh[i, k] += delta.sh[e, k] * w


@inlined
def _spread_row(i: int, row_ptr: I64, column: I64, weights: F32, gradient: Values, out: Values) -> None:
    width = gradient.sh.shape[1]
    for e in range(row_ptr[i], row_ptr[i + 1]):
        w = weights[column[e]]
        for k in range(3):
            out.mean[e, k] = gradient.mean[i, k] * w
            out.log_scale[e, k] = gradient.log_scale[i, k] * w
        for k in range(4):
            out.quat_wxyz[e, k] = gradient.quat_wxyz[i, k] * w
        out.opacity_logit[e] = gradient.opacity_logit[i] * w
        for k in range(width):
            out.sh[e, k] = gradient.sh[i, k] * w
