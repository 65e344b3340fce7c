"""Stage `blend` of a block: base + sum_k w_k delta_k in training space, each sparse row read as stored.

The entries of nonzero weight are listed first, from the bits of their columns; then only these are read. A branch
for each entry would often be mispredicted and would wait for memory each time.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import types

from avatar_runtime.avatar import F32, U32
from avatar_runtime.backends.cpu.arrays import BLOCK, U8, Base, Deltas, Offsets, PosedArrays
from avatar_runtime.backends.cpu.deform.planes import MEAN
from avatar_runtime.backends.cpu.jit import Scalar, inlined
from avatar_runtime.backends.cpu.lanes import (
    intrinsic,
    sum_in_turn_4,
    sum_in_turn_8,
    sum_listed_4,
    sum_listed_8,
)

ZERO, BIT = np.float32(0), np.uint64(1)
Ends = npt.NDArray[np.int64]


@intrinsic
def bit_count(typing: Any, bits: Any) -> Any:
    """How many bits of a uint64 are 1."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.ctpop(values[0])

    return types.int64(types.uint64), emit


@inlined
def every_active(posed: PosedArrays) -> bool:
    """Whether no expression has weight 0."""
    active = 0
    for word in range(len(posed.expression_mask)):
        active += bit_count(posed.expression_mask[word])
    return active == len(posed.expression_weights)


@inlined
def list_active(
    first: int, count: int, deltas: Deltas, posed: PosedArrays, entry: U32, end: Ends
) -> tuple[bool, int]:
    """Lists in `entry` the active entries of `count` rows; those of lane l end before end[l], where l + 1 begins.

    Returns whether all entries are active (they are then not listed; begin and end are their own numbers), and where
    those of lane 0 begin.
    """
    if every_active(posed):
        for lane in range(count):
            end[lane] = deltas.row_ptr[first + lane + 1]
        start: Any = np.int64(deltas.row_ptr[first])
        return True, start
    n = 0
    for lane in range(count):
        e = np.int64(deltas.row_ptr[first + lane])
        for word in range(deltas.mask.shape[1]):
            own = deltas.mask[first + lane, word]
            active = own & posed.expression_mask[word]
            if active == own:
                for k in range(bit_count(own)):
                    entry[n + k] = e + k
                n += bit_count(own)
            else:
                while active:
                    following = active & (active - BIT)
                    entry[n] = e + bit_count(own & ((active ^ following) - BIT))
                    n += 1
                    active = following
            e += bit_count(own)
        end[lane] = n
    return False, 0


@inlined
def blend_geometry(
    first: int,
    count: int,
    base: Base,
    geometry: Deltas,
    posed: PosedArrays,
    entry: U32,
    end: Ends,
    planes: F32,
) -> None:
    """MEAN and raw QUAT of `count` Gaussians from `first`; `entry` and `end` are room."""
    every, begin = list_active(first, count, geometry, posed, entry, end)
    values, column, weights = geometry.values, geometry.column, posed.expression_weights
    for lane in range(count):
        last = end[lane]
        if every:
            x, y, z, qw, qx, qy, qz, _ = sum_in_turn_8(values, column, weights, entry, begin, last)
        else:
            x, y, z, qw, qx, qy, qz, _ = sum_listed_8(values, column, weights, entry, begin, last)
        begin = last
        i, at = first + lane, MEAN + lane
        planes[at] = base.mean[i, 0] + x
        planes[at + BLOCK] = base.mean[i, 1] + y
        planes[at + 2 * BLOCK] = base.mean[i, 2] + z
        planes[at + 3 * BLOCK] = base.quat_wxyz[i, 0] + qw  # QUAT follows MEAN
        planes[at + 4 * BLOCK] = base.quat_wxyz[i, 1] + qx
        planes[at + 5 * BLOCK] = base.quat_wxyz[i, 2] + qy
        planes[at + 6 * BLOCK] = base.quat_wxyz[i, 3] + qz


@inlined
def blend_shape(
    i: int, base: Base, shape: Deltas, posed: PosedArrays, entry: U32, every: bool, begin: int, end: int
) -> tuple[Scalar, Scalar, Scalar, Scalar]:
    """Log scale (3) and opacity logit of Gaussian `i`; `every`, `begin` and `end` by `list_active`."""
    values, column, weights = shape.values, shape.column, posed.expression_weights
    if every:
        x, y, z, logit = sum_in_turn_4(values, column, weights, entry, begin, end)
    else:
        x, y, z, logit = sum_listed_4(values, column, weights, entry, begin, end)
    scale = base.log_scale
    return scale[i, 0] + x, scale[i, 1] + y, scale[i, 2] + z, base.opacity_logit[i] + logit


@inlined
def blend_sh(
    i: int,
    base: Base,
    colour: Deltas,
    posed: PosedArrays,
    entry: U32,
    every: bool,
    begin: int,
    end: int,
    out: F32,
) -> None:
    """SH of Gaussian `i`, into row `i` of `out` [N, 3 K]; `every`, `begin` and `end` by `list_active`."""
    row, start = out[i], base.sh[i]
    for k in range(len(row)):
        row[k] = start[k]
    for j in range(begin, end):
        e = j if every else np.int64(entry[j])
        w, delta = posed.expression_weights[colour.column[e]], colour.values[e]
        for k in range(len(row)):
            row[k] += delta[k] * w


@inlined
def colour_block(
    first: int,
    count: int,
    base: Base,
    colour: Deltas,
    posed: PosedArrays,
    entry: U32,
    end: Ends,
    touched: U8,
    out: F32,
) -> None:
    """SH of `count` Gaussians from `first`, where an expression moves them or did in the previous frame."""
    every, begin = list_active(first, count, colour, posed, entry, end)
    for lane in range(count):
        i, last = first + lane, end[lane]
        if last > begin or touched[i, 1]:
            blend_sh(i, base, colour, posed, entry, every, begin, last, out)
            touched[i, 1] = last > begin
        begin = last


@inlined
def offset_of(i: int, offsets: Offsets, weights: F32) -> tuple[Scalar, Scalar, Scalar]:
    """Sum over row `i` of weight * offset; offsets of weight 0 are not read."""
    x = y = z = ZERO
    for e in range(offsets.row_ptr[i], offsets.row_ptr[i + 1]):
        w = weights[offsets.column[e]]
        if w != ZERO:
            x += offsets.offset[e, 0] * w
            y += offsets.offset[e, 1] * w
            z += offsets.offset[e, 2] * w
    return x, y, z
