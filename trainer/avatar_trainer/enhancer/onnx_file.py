"""The network of `enhancer` as an ONNX file, for the runtime and for engines: same weights, same bytes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from onnx import ModelProto, NodeProto, TensorProto, helper, numpy_helper
from torch import Tensor

from avatar_runtime import Enhancer
from avatar_runtime.checks import enhancer
from avatar_trainer.enhancer.network import (
    CHANNELS,
    MULTIPLE,
    Layer,
    bias_name,
    layers,
    weight_name,
    width_of,
)

OPSET = (
    15  # engines read it too (Unity's Inference Engine up to 15); the operators used have not changed since
)
IR_VERSION = 8  # that of opset 15
PRODUCER = "avatar-export"
INPUT, OUTPUT = "colour", "enhanced"
SIZES = {  # whole numbers that pad and crop, and their values
    "multiple": (MULTIPLE,),
    "not_padded": (0, 0, 0, 0, 0, 0),  # batch, channels, top, left; then batch, channels behind
    "origin": (0, 0),
    "axes": (2, 3),
}


def onnx_enhancer(
    weights: Mapping[str, Tensor],
    *,
    trained_width: int,
    trained_height: int,
    psnr_raw_db: float | None,
    psnr_enhanced_db: float | None,
    measured_on: str,
) -> Enhancer:
    """The enhancer of an avatar: the trained network, and its measured quality.

    PSNR in dB over the images that `measured_on` names, which were not trained on; None: not measured.
    Raises ValueError for weights of another network, AvatarError for impossible values.
    """
    return enhancer.check_enhancer(
        Enhancer(
            onnx=encode(weights),
            input=INPUT,
            output=OUTPUT,
            trained_width=trained_width,
            trained_height=trained_height,
            psnr_raw_db=psnr_raw_db,
            psnr_enhanced_db=psnr_enhanced_db,
            measured_on=measured_on,
        )
    )


def encode(weights: Mapping[str, Tensor]) -> bytes:
    """The ONNX file: `colour` f32[1, 3, H, W] in, `enhanced` f32[1, 3, H, W] out, any H and W.

    Raises ValueError for weights of another network.
    """
    data: bytes = _model(weights).SerializeToString(deterministic=True)
    return data


def _model(weights: Mapping[str, Tensor]) -> ModelProto:
    network = layers(width_of(weights))
    constants = [_constant(name, np.array(values, np.int64)) for name, values in SIZES.items()]
    for layer in network:
        for name in (weight_name(layer), bias_name(layer)):
            values = weights[name].detach().cpu().numpy().astype("<f4")
            constants.append(_constant(name, values))
    shape: list[str | int | None] = [1, CHANNELS, "height", "width"]
    graph = helper.make_graph(
        [*_padded(), *_network(network), *_cropped()],
        "enhancer",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, shape)],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, shape)],
        constants,
    )
    return helper.make_model(
        graph, producer_name=PRODUCER, ir_version=IR_VERSION, opset_imports=[helper.make_opsetid("", OPSET)]
    )


def _padded() -> list[NodeProto]:
    """`raw`: the image, its right and lower edge repeated up to a multiple of MULTIPLE."""
    return [
        helper.make_node("Shape", [INPUT], ["size"], start=2),
        helper.make_node("Neg", ["size"], ["size_negative"]),
        helper.make_node("Mod", ["size_negative", "multiple"], ["gap"]),  # of the divisor's sign, as Python's
        helper.make_node("Concat", ["not_padded", "gap"], ["pads"], axis=0),
        helper.make_node("Pad", [INPUT, "pads"], ["raw"], mode="edge"),
    ]


def _cropped() -> list[NodeProto]:
    return [helper.make_node("Slice", ["better", "origin", "size", "axes"], [OUTPUT])]


def _network(network: Mapping[str, Layer]) -> list[NodeProto]:
    """From `raw` to `better`, as in `enhancer.enhanced`; a layer's output has the layer's name."""
    nodes: list[NodeProto] = []

    def add(operator: str, inputs: Sequence[str], output: str, **attributes: Any) -> str:
        nodes.append(helper.make_node(operator, inputs, [output], **attributes))
        return output

    def convolved(name: str, x: str) -> str:
        layer = network[name]
        return add(
            "ConvTranspose" if layer.up else "Conv",
            [x, weight_name(name), bias_name(name)],
            name,
            kernel_shape=[layer.kernel] * 2,
            strides=[layer.stride] * 2,
            pads=[layer.padding] * 4,
        )

    def activated(name: str, x: str) -> str:
        return add("Relu", [convolved(name, x)], f"{name}_relu")

    def joined(skip: str, x: str) -> str:
        return add("Concat", [skip, x], f"{x}_joined", axis=1)

    half = activated("half_in", activated("half_down", "raw"))
    quarter = activated("quarter_in", activated("quarter_down", half))
    eighth = activated("eighth_out", activated("eighth_in", activated("eighth_down", quarter)))
    back = activated("quarter_out", joined(quarter, convolved("quarter_up", eighth)))
    back = activated("half_out", joined(half, convolved("half_up", back)))
    back = activated("full_out", joined("raw", convolved("full_up", back)))
    add("Add", ["raw", convolved("correction", back)], "better")
    return nodes


def _constant(name: str, values: npt.NDArray[np.float32 | np.int64]) -> TensorProto:
    return numpy_helper.from_array(np.ascontiguousarray(values), name)
