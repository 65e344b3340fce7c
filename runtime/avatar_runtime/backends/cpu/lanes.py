"""Processor instructions that Numba does not offer: fused multiply-add, exp, bits, a shared counter."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import extending, types
from numba.core import cgutils as untyped

from avatar_runtime.backends.cpu.jit import inlined

cgutils: Any = untyped
vector_of: Any = types.UniTuple
intrinsic: Callable[[Callable[..., Any]], Any] = extending.intrinsic

f32 = np.float32
LOG2_E = f32(1.4426950408889634)
LN_2 = f32(0.6931471805599453)
ROUNDER = f32(3 << 22)  # adding 1.5 * 2^23 leaves the nearest integer in the low bits of a float32
MOST_EXPONENT = f32(88.7228)  # e to this power is still a float32
LEAST_EXPONENT = f32(-87)  # e^-87 is the last normal float32; far below 1/255 of any opacity
# e^t - 1 - t over t^2 for |t| <= ln 2 / 2, least largest relative error of e^t: 1.1e-7.
C2, C3, C4, C5 = f32(0.4999923), f32(0.16667115), f32(0.04189033), f32(0.0083125)

INFINITE = f32(np.inf)

# atanh(s) over s by powers of s^2: of a mantissa between 1/sqrt 2 and sqrt 2, |s| <= 0.172, it is 1e-8 from ln.
A2, A4, A6 = f32(1 / 3), f32(1 / 5), f32(1 / 7)
ROOT_HALF_BITS = np.int32(0x3F3504F3)  # of sqrt(1/2)

# ln(1 + t) over t for 0 <= t <= 1, least largest error of ln: 7e-5.
L1, L2, L3, L4 = f32(0.99744896), f32(-0.47130118), f32(0.22568545), f32(-0.05875697)


@intrinsic
def fma(typing: Any, a: Any, b: Any, c: Any) -> Any:
    """a b + c of float32, rounded once."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.fma(*values)

    return types.float32(types.float32, types.float32, types.float32), emit


@intrinsic
def add_to_exponent(typing: Any, value: Any, rounded: Any) -> Any:
    """value 2^n, n from the low bits of ROUNDER + n; the result must be a normal float32."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        word = ir.IntType(32)
        bits, n = (builder.bitcast(v, word) for v in values)
        moved = builder.add(bits, builder.shl(n, ir.Constant(word, 23)))
        return builder.bitcast(moved, ir.FloatType())

    return types.float32(types.float32, types.float32), emit


@intrinsic
def lowest_bit(typing: Any, mask: Any) -> Any:
    """Index of the lowest set bit of a uint32 that is not 0."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.zext(builder.cttz(values[0], ir.Constant(ir.IntType(1), 1)), ir.IntType(64))

    return types.uint64(types.uint32), emit


@intrinsic
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


@intrinsic
def float_bits(typing: Any, value: Any) -> Any:
    """The bits of a float32."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.bitcast(values[0], ir.IntType(32))

    return types.int32(types.float32), emit


@intrinsic
def float_of(typing: Any, bits: Any) -> Any:
    """The float32 of these bits, the low 32 of an integer."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.bitcast(values[0], ir.FloatType())

    return types.float32(types.int32), emit


@intrinsic
def prefetch(typing: Any, values: Any, at: Any) -> Any:
    """Ask for the cache line of element `at`, counted through the whole of a contiguous array."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, offset = arguments
        start = builder.gep(context.make_array(signature.args[0])(context, builder, array).data, [offset])
        byte, word = ir.IntType(8).as_pointer(), ir.IntType(32)
        function_type = ir.FunctionType(ir.VoidType(), [byte, word, word, word])
        function = builder.module.declare_intrinsic("llvm.prefetch", [byte], function_type)
        read, keep, data = (ir.Constant(word, value) for value in (0, 3, 1))
        builder.call(function, [builder.bitcast(start, byte), read, keep, data])
        return context.get_dummy_value()

    return types.none(values, types.int64), emit


def weighted_sum(width: int, listed: bool) -> Any:
    """A sum over rows of `width` float32 that are `listed`, or follow one another.

    Each step is one vector operation, which LLVM does not find by itself.
    """

    @intrinsic
    def summed(typing: Any, values: Any, column: Any, weights: Any, entry: Any, begin: Any, end: Any) -> Any:
        """Sum of weights[column[e]] * values[e] in order, e in entry[begin:end] or begin..end; values [E, width]."""

        def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            rows, columns, factors, entries = (
                context.make_array(kind)(context, builder, array).data
                for kind, array in zip(signature.args[:4], arguments[:4], strict=True)
            )
            word, index = ir.IntType(64), ir.IntType(32)
            vector = ir.VectorType(ir.FloatType(), width)
            total = cgutils.alloca_once_value(builder, ir.Constant(vector, [0.0] * width))
            step = ir.Constant(word, 1)
            with cgutils.for_range_slice(builder, *arguments[4:], step, word) as (at, _):
                e = builder.zext(builder.load(builder.gep(entries, [at])), word) if listed else at
                k = builder.zext(builder.load(builder.gep(columns, [e])), word)
                weight = builder.load(builder.gep(factors, [k]))
                row = builder.gep(rows, [builder.mul(e, ir.Constant(word, width))])
                lanes = builder.load(builder.bitcast(row, vector.as_pointer()), align=4)
                one = builder.insert_element(ir.Constant(vector, ir.Undefined), weight, ir.Constant(index, 0))
                every = builder.shuffle_vector(
                    one, one, ir.Constant(ir.VectorType(index, width), [0] * width)
                )
                builder.store(builder.fadd(builder.load(total), builder.fmul(lanes, every)), total)
            result = builder.load(total)
            parts = [builder.extract_element(result, ir.Constant(index, lane)) for lane in range(width)]
            return context.make_tuple(builder, signature.return_type, parts)

        kinds = (values, column, weights, entry, types.int64, types.int64)
        return vector_of(types.float32, width)(*kinds), emit

    return summed


sum_listed_4, sum_listed_8 = weighted_sum(4, True), weighted_sum(8, True)
sum_in_turn_4, sum_in_turn_8 = weighted_sum(4, False), weighted_sum(8, False)


@intrinsic
def take_next(typing: Any, counter: Any) -> Any:
    """Returns counter[0] of an int64 array that threads share, and adds one to it."""

    def emit(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        pointer = context.make_array(signature.args[0])(context, builder, values[0]).data
        return builder.atomic_rmw("add", pointer, ir.Constant(ir.IntType(64), 1), "monotonic")

    return types.int64(counter), emit


@inlined
def exponential(x: np.float32) -> np.float32:
    """e^x for x <= 0, relative error 2e-7; at least e^-87. Exactly 1 at 0. NaN gives e^-87."""
    bounded = x if x > LEAST_EXPONENT else LEAST_EXPONENT
    rounded = fma(bounded, LOG2_E, ROUNDER)
    t = fma(rounded - ROUNDER, -LN_2, bounded)
    series = fma(fma(fma(C5, t, C4), t, C3), t, C2)
    result: np.float32 = add_to_exponent(fma(fma(series, t, f32(1)), t, f32(1)), rounded)
    return result


@inlined
def exponential_of_any(x: np.float32) -> np.float32:
    """e^x, relative error 4e-7; infinite beyond float32, at least e^-87, NaN of NaN."""
    result = exponential(x if x < MOST_EXPONENT else MOST_EXPONENT)
    return result if x <= MOST_EXPONENT else x + INFINITE


@inlined
def rough_log(x: np.float32) -> np.float32:
    """ln x of a positive float32 to within 1e-4; negative for 0 and below, large for what is not finite."""
    bits = np.int32(float_bits(x))
    fraction = float_of(np.int32(bits & 0x7FFFFF | 0x3F800000)) - f32(1)
    series = fma(fma(fma(L4, fraction, L3), fraction, L2), fraction, L1)
    result: np.float32 = fma(f32(np.int32(bits >> 23)) - f32(127), LN_2, series * fraction)
    return result


@inlined
def logarithm(x: np.float32) -> np.float32:
    """ln x of a positive normal float32, to within 1e-7 and one rounding; of others it is finite."""
    bits = np.int32(float_bits(x)) - ROOT_HALF_BITS
    mantissa = float_of(np.int32((bits & 0x7FFFFF) + ROOT_HALF_BITS))
    s = (mantissa - f32(1)) / (mantissa + f32(1))
    ss = s * s
    series = fma(fma(fma(A6, ss, A4), ss, A2), ss, f32(1))
    result: np.float32 = fma(f32(np.int32(bits >> 23)), LN_2, f32(2) * s * series)
    return result


@inlined
def power(x: np.float32, exponent: np.float32) -> np.float32:
    """x^exponent, relative error 2e-6 for a result within 1e-9 and 1e9; 0 for 0 and below; what is not finite stays."""
    result = exponential_of_any(exponent * logarithm(x))
    result = result if x > f32(0) else f32(0)
    return result if x < INFINITE else x
