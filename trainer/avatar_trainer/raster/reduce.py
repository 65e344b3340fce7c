"""A sum over 16 lanes as four vector additions; LLVM does not vectorise a loop that must add in order."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types

from avatar_runtime.backends.cpu import intrinsic


@intrinsic
def sum_of_16(typing: Any, values: Any, at: Any) -> Any:
    """Sum of values[at : at + 16], contiguous float32: halves are added until one lane is left."""

    def emit(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array, offset = arguments
        vector, index = ir.VectorType(ir.FloatType(), 16), ir.IntType(32)
        start = builder.gep(context.make_array(signature.args[0])(context, builder, array).data, [offset])
        lanes = builder.load(builder.bitcast(start, vector.as_pointer()), align=4)
        for width in (8, 4, 2, 1):
            low, high = (
                ir.Constant(ir.VectorType(index, width), list(range(first, first + width)))
                for first in (0, width)
            )
            none = ir.Constant(lanes.type, ir.Undefined)
            lanes = builder.fadd(
                builder.shuffle_vector(lanes, none, low), builder.shuffle_vector(lanes, none, high)
            )
        return builder.extract_element(lanes, ir.Constant(index, 0))

    return types.float32(values, types.int64), emit
