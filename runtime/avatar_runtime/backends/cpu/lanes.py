"""What a kernel needs of the processor and Numba does not offer: fused multiply-add, exp, bits, a shared counter."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

f32 = np.float32
LOG2_E = f32(1.4426950408889634)
MINUS_LN_2 = f32(-0.6931471805599453)
ROUNDER = f32(3 << 22)  # adding 1.5 * 2^23 leaves the nearest integer in the low bits of a float32
LEAST_EXPONENT = f32(-87)  # e^-87 is the last normal float32; far below 1/255 of any opacity
# e^t - 1 - t over t^2 for |t| <= ln 2 / 2, least largest relative error of e^t: 1.1e-7.
C2, C3, C4, C5 = f32(0.4999923), f32(0.16667115), f32(0.04189033), f32(0.0083125)


@intrinsic  # type: ignore[untyped-decorator]
def fma(typing: Any, a: Any, b: Any, c: Any) -> Any:
    """a b + c of float32, rounded once."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.fma(*values)

    return types.float32(types.float32, types.float32, types.float32), emit


@intrinsic  # type: ignore[untyped-decorator]
def add_to_exponent(typing: Any, value: Any, rounded: Any) -> Any:
    """value 2^n, n from the low bits of ROUNDER + n; the result must be a normal float32."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        word = ir.IntType(32)
        bits, n = (builder.bitcast(v, word) for v in values)
        moved = builder.add(bits, builder.shl(n, ir.Constant(word, 23)))
        return builder.bitcast(moved, ir.FloatType())

    return types.float32(types.float32, types.float32), emit


@intrinsic  # type: ignore[untyped-decorator]
def lowest_bit(typing: Any, mask: Any) -> Any:
    """Index of the lowest set bit of a uint32 that is not 0."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.zext(builder.cttz(values[0], ir.Constant(ir.IntType(1), 1)), ir.IntType(64))

    return types.uint64(types.uint32), emit


@intrinsic  # type: ignore[untyped-decorator]
def lanes_above(typing: Any, values: Any, at: Any, bound: Any) -> Any:
    """Bit i of the uint32: values[at + i] > bound, i < 16, of contiguous float32; not a number is not above."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, offset, least = arguments
        vector = ir.VectorType(ir.FloatType(), 16)
        start = builder.gep(context.make_array(signature.args[0])(context, builder, array).data, [offset])
        lanes = builder.load(builder.bitcast(start, vector.as_pointer()), align=4)
        bounds = ir.Constant(vector, ir.Undefined)
        for lane in range(16):
            bounds = builder.insert_element(bounds, least, ir.Constant(ir.IntType(32), lane))
        above = builder.fcmp_ordered(">", lanes, bounds)
        return builder.zext(builder.bitcast(above, ir.IntType(16)), ir.IntType(32))

    return types.uint32(values, types.int64, types.float32), emit


@intrinsic  # type: ignore[untyped-decorator]
def float_bits(typing: Any, value: Any) -> Any:
    """The bits of a float32."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.bitcast(values[0], ir.IntType(32))

    return types.uint32(types.float32), emit


@intrinsic  # type: ignore[untyped-decorator]
def take_next(typing: Any, counter: Any) -> Any:
    """The value of counter[0], an int64 array that threads share, and one more in its place."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        pointer = context.make_array(signature.args[0])(context, builder, values[0]).data
        return builder.atomic_rmw("add", pointer, ir.Constant(ir.IntType(64), 1), "monotonic")

    return types.int64(counter), emit


@njit(forceinline=True)
def exponential(x: float) -> float:
    """e^x for x <= 0, relative error 2e-7; at least e^-87. Exactly 1 at 0. NaN gives e^-87."""
    bounded = x if x > LEAST_EXPONENT else LEAST_EXPONENT
    rounded = fma(bounded, LOG2_E, ROUNDER)
    t = fma(rounded - ROUNDER, MINUS_LN_2, bounded)
    series = fma(fma(fma(C5, t, C4), t, C3), t, C2)
    return add_to_exponent(fma(fma(series, t, f32(1)), t, f32(1)), rounded)
