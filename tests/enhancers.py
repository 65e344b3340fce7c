"""A tiny enhancer whose answer NumPy knows: per pixel, raw + B relu(A raw + a) + b, padded and cropped as ours are."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import numpy.typing as npt
from onnx import ModelProto, TensorProto, helper, numpy_helper

from avatar_runtime.avatar import Enhancer

HIDDEN, MULTIPLE = 5, 4
Array = npt.NDArray[np.float32]


def weights() -> tuple[Array, Array, Array, Array]:
    """A [5, 3], a [5], B [3, 5], b [3]."""
    rng = np.random.default_rng(7)
    shapes = ((HIDDEN, 3), (HIDDEN,), (3, HIDDEN), (3,))
    first, bias, second, offset = (rng.normal(0, 0.4, shape).astype(np.float32) for shape in shapes)
    return first, bias, second, offset


def expected(colour: Array) -> npt.NDArray[np.float64]:
    """What the network makes of an image [H, W, 3]."""
    first, bias, second, offset = weights()
    hidden = np.maximum(colour.astype(np.float64) @ first.T + bias, 0)
    return colour + hidden @ second.T + offset


def model() -> ModelProto:
    """The network; a new one each time, to be changed."""
    first, bias, second, offset = weights()
    one = {"kernel_shape": [1, 1], "strides": [1, 1], "pads": [0, 0, 0, 0]}
    nodes = [
        helper.make_node("Shape", ["colour"], ["size"], start=2),
        helper.make_node("Neg", ["size"], ["negative"]),
        helper.make_node("Mod", ["negative", "multiple"], ["gap"]),
        helper.make_node("Concat", ["none", "gap"], ["pads"], axis=0),
        helper.make_node("Pad", ["colour", "pads"], ["raw"], mode="edge"),
        helper.make_node("Conv", ["raw", "A", "a"], ["hidden"], **one),
        helper.make_node("Relu", ["hidden"], ["positive"]),
        helper.make_node("Conv", ["positive", "B", "b"], ["correction"], **one),
        helper.make_node("Add", ["raw", "correction"], ["better"]),
        helper.make_node("Slice", ["better", "origin", "size", "axes"], ["enhanced"]),
    ]
    constants = {
        "A": first[:, :, None, None],
        "a": bias,
        "B": second[:, :, None, None],
        "b": offset,
        "multiple": np.array([MULTIPLE]),
        "none": np.zeros(6, np.int64),
        "origin": np.zeros(2, np.int64),
        "axes": np.array([2, 3]),
    }
    graph = helper.make_graph(
        nodes,
        "tiny",
        [helper.make_tensor_value_info("colour", TensorProto.FLOAT, [1, 3, "h", "w"])],
        [helper.make_tensor_value_info("enhanced", TensorProto.FLOAT, [1, 3, "h", "w"])],
        [numpy_helper.from_array(values, name) for name, values in constants.items()],
    )
    return helper.make_model(graph, ir_version=8, opset_imports=[helper.make_opsetid("", 15)])


@cache
def tiny() -> Enhancer:
    """It, and facts without a default value."""
    return Enhancer(
        onnx=model().SerializeToString(deterministic=True),
        input="colour",
        output="enhanced",
        trained_width=320,
        trained_height=240,
        psnr_raw_db=27.5,
        psnr_enhanced_db=29.25,
        measured_on="12 frames that were held out",
    )


def changed(change: Callable[[ModelProto], object]) -> Enhancer:
    """`tiny` with a change to its network."""
    network = model()
    change(network)
    return Enhancer(**{**vars(tiny()), "onnx": network.SerializeToString()})
