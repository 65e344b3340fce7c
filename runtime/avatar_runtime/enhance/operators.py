"""The ONNX operators that an enhancer may use, and the size of their results, known before the network is run."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any

LARGEST_WHOLE = 1 << 31  # of sizes and pads


@dataclass(frozen=True)
class Value:
    """What is known of a tensor before a run: its shape, and its numbers where they are whole ones."""

    shape: tuple[int, ...]
    whole: tuple[int, ...] | None = None  # of int64 [n]; None: float32


Attributes = Mapping[str, Any]


@dataclass(frozen=True)
class Operator:
    """How many inputs, which attributes (all are required, each with an allowed value), and the shape of the result."""

    inputs: int
    attributes: Mapping[str, Collection[Any]]
    result: Callable[[Sequence[Value], Attributes], Value]  # ValueError for inputs that do not fit
    products_a_pixel: Callable[[Sequence[Value]], int] = lambda _: (
        0
    )  # multiplications for a pixel of the result


def _floats(value: Value, rank: int) -> tuple[int, ...]:
    if value.whole is not None or len(value.shape) != rank:
        raise ValueError(f"takes float32 of {rank} axes")
    return value.shape


def _whole(value: Value, count: int | None = None) -> tuple[int, ...]:
    if value.whole is None or (count is not None and len(value.whole) != count):
        raise ValueError(f"takes {count or 'some'} whole numbers")
    return value.whole


def _image(*shape: int) -> Value:
    if min(shape) < 1:
        raise ValueError("leaves nothing")
    return Value(shape)


def _numbers(numbers: Sequence[int]) -> Value:
    if any(abs(number) > LARGEST_WHOLE for number in numbers):
        raise ValueError("gives numbers that are too large")
    return Value((len(numbers),), tuple(numbers))


def _same(inputs: Sequence[Value], _: Attributes) -> Value:
    shapes = {_floats(value, 4) for value in inputs}
    if len(shapes) > 1:
        raise ValueError(f"takes images of one shape, not {' and '.join(map(str, sorted(shapes)))}")
    return Value(*shapes)


def _concat(inputs: Sequence[Value], attributes: Attributes) -> Value:
    if attributes["axis"] == 0:
        return _numbers([number for value in inputs for number in _whole(value)])
    shapes = [_floats(value, 4) for value in inputs]
    if len({(shape[0], *shape[2:]) for shape in shapes}) > 1:
        raise ValueError(f"takes images of one size, not {' and '.join(map(str, shapes))}")
    return _image(shapes[0][0], sum(shape[1] for shape in shapes), *shapes[0][2:])


def _convolution(inputs: Sequence[Value], attributes: Attributes, transposed: bool) -> Value:
    x, kernel, bias = (_floats(value, rank) for value, rank in zip(inputs, (4, 4, 1), strict=True))
    kernel_shape, strides, pads = (tuple(attributes[name]) for name in ("kernel_shape", "strides", "pads"))
    taken, given = (kernel[0], kernel[1]) if transposed else (kernel[1], kernel[0])
    if kernel[2:] != kernel_shape or taken != x[1] or bias != (given,) or len(strides) != 2 or len(pads) != 4:
        raise ValueError(f"of a kernel {kernel} and a bias {bias} does not fit an image {x}")
    sizes = []
    for axis in (0, 1):
        length, stride = x[2 + axis], strides[axis]
        padding = pads[axis] + pads[2 + axis]
        if transposed:
            sizes.append((length - 1) * stride + kernel_shape[axis] - padding)
        else:
            sizes.append((length + padding - kernel_shape[axis]) // stride + 1)
    return _image(x[0], given, *sizes)


def _conv(inputs: Sequence[Value], attributes: Attributes) -> Value:
    return _convolution(inputs, attributes, transposed=False)


def _conv_transpose(inputs: Sequence[Value], attributes: Attributes) -> Value:
    return _convolution(inputs, attributes, transposed=True)


def _mod(inputs: Sequence[Value], _: Attributes) -> Value:
    (divisor,) = _whole(inputs[1], 1)
    if divisor < 1:
        raise ValueError(f"divides by {divisor}")
    return _numbers([number % divisor for number in _whole(inputs[0])])


def _neg(inputs: Sequence[Value], _: Attributes) -> Value:
    return _numbers([-number for number in _whole(inputs[0])])


def _pad(inputs: Sequence[Value], _: Attributes) -> Value:
    shape, pads = _floats(inputs[0], 4), _whole(inputs[1], 8)
    if any(pads[axis] for axis in (0, 1, 4, 5)) or min(pads) < 0:
        raise ValueError(f"by {pads}: takes an image by its height and width, and nothing away")
    return _image(shape[0], shape[1], *(shape[axis] + pads[axis] + pads[axis + 4] for axis in (2, 3)))


def _shape(inputs: Sequence[Value], _: Attributes) -> Value:
    return _numbers(_floats(inputs[0], 4)[2:])


def _slice(inputs: Sequence[Value], _: Attributes) -> Value:
    shape = _floats(inputs[0], 4)
    starts, ends, axes = (_whole(value, 2) for value in inputs[1:])
    if axes != (2, 3) or min(*starts, *ends) < 0:
        raise ValueError(f"of {starts} to {ends} along {axes}: takes height and width, counted from 0")
    return _image(
        shape[0],
        shape[1],
        *(min(end, size) - start for start, end, size in zip(starts, ends, shape[2:], strict=True)),
    )


def _weights(inputs: Sequence[Value]) -> int:
    return prod(inputs[1].shape)


CONVOLUTION = {"kernel_shape": range(1, 8), "strides": range(1, 5), "pads": range(8)}
OPERATORS: Mapping[str, Operator] = {
    "Add": Operator(2, {}, _same),
    "Concat": Operator(2, {"axis": (0, 1)}, _concat),
    "Conv": Operator(3, CONVOLUTION, _conv, _weights),
    "ConvTranspose": Operator(3, CONVOLUTION, _conv_transpose, _weights),
    "Mod": Operator(2, {}, _mod),
    "Neg": Operator(1, {}, _neg),
    "Pad": Operator(2, {"mode": (b"edge",)}, _pad),
    "Relu": Operator(1, {}, _same),
    "Shape": Operator(1, {"start": (2,)}, _shape),
    "Slice": Operator(4, {}, _slice),
}
