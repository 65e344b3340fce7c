"""A small U-Net that improves a drawn image, as in PSAvatar (section 3.3).

enhanced = raw + correction, and the layer that makes the correction starts at zero: an untrained one changes nothing.
The weights are named tensors that a `Table` can hold, each a row set of its own; `enhancer_onnx` writes the same
network for the runtime.

The paper only calls its network a "U-net". This one halves the image three times and doubles it again, with a skip
at each size. The skip at full size is the raw image itself, so wide layers run on a quarter of the pixels or less.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Generator, Tensor
from torch.nn import functional

WIDTH = 16  # channels at half size; 131,000 weights, about 60 ms forward and backward for 256 x 256 on a core
MULTIPLE = 8  # images are padded by at most this many pixels, by repeating their edge
CHANNELS = 3  # red, green, blue


@dataclass(frozen=True)
class Layer:
    """One convolution; with `up` a transposed one, from each pixel to stride x stride others."""

    name: str
    inputs: int
    outputs: int
    kernel: int
    stride: int = 1
    padding: int = 0
    up: bool = False

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """The shape of its weight, as in torch and ONNX."""
        first = (self.inputs, self.outputs) if self.up else (self.outputs, self.inputs)
        return (*first, self.kernel, self.kernel)


def layers(width: int) -> dict[str, Layer]:
    """Every convolution of a network with `width` channels at half size, by name, in order."""
    full, half, quarter, eighth = width // 2, width, 2 * width, 4 * width
    rows = (
        Layer("half_down", CHANNELS, half, 4, 2, 1),
        Layer("half_in", half, half, 3, 1, 1),
        Layer("quarter_down", half, quarter, 2, 2),
        Layer("quarter_in", quarter, quarter, 3, 1, 1),
        Layer("eighth_down", quarter, eighth, 2, 2),
        Layer("eighth_in", eighth, eighth, 3, 1, 1),
        Layer("eighth_out", eighth, eighth, 3, 1, 1),
        Layer("quarter_up", eighth, quarter, 2, 2, up=True),
        Layer("quarter_out", 2 * quarter, quarter, 3, 1, 1),
        Layer("half_up", quarter, half, 2, 2, up=True),
        Layer("half_out", 2 * half, half, 3, 1, 1),
        Layer("full_up", half, full, 2, 2, up=True),
        Layer("full_out", CHANNELS + full, full, 3, 1, 1),
        Layer("correction", full, CHANNELS, 3, 1, 1),
    )
    return {layer.name: layer for layer in rows}


def weight_name(layer: str) -> str:
    """The name of a layer's kernel."""
    return f"enhancer.{layer}.weight"


def bias_name(layer: str) -> str:
    """The name of a layer's bias."""
    return f"enhancer.{layer}.bias"


WEIGHTS = tuple(name(layer) for layer in layers(WIDTH) for name in (weight_name, bias_name))


def initial_weights(generator: Generator, width: int = WIDTH) -> dict[str, Tensor]:
    """The tensors named WEIGHTS, float32, of an enhancer that changes nothing yet.

    Kernels are normal with variance 2 / inputs (He et al. 2015, for ReLU), those of the last layer and all biases 0.
    Raises ValueError for a width that is not even and positive.
    """
    if width < 2 or width % 2:
        raise ValueError(f"{width} channels at half size: an even number, 2 or more")
    weights = {}
    for layer in layers(width).values():
        fan_in = layer.inputs * (1 if layer.up else layer.kernel**2)
        kernel = torch.randn(layer.shape, generator=generator) * (2 / fan_in) ** 0.5
        weights[weight_name(layer.name)] = torch.zeros_like(kernel) if layer.name == "correction" else kernel
        weights[bias_name(layer.name)] = torch.zeros(layer.outputs)
    return weights


def width_of(weights: Mapping[str, Tensor]) -> int:
    """Channels at half size of a set of weights. Raises ValueError for weights of another network."""
    missing = [name for name in WEIGHTS if name not in weights]
    if missing:
        raise ValueError(f"weights lack {', '.join(missing[:3])}")
    width = len(weights[bias_name("half_down")])
    for layer in layers(width).values():
        for name, shape in (
            (weight_name(layer.name), layer.shape),
            (bias_name(layer.name), (layer.outputs,)),
        ):
            if tuple(weights[name].shape) != shape:
                raise ValueError(f"{name} is {tuple(weights[name].shape)}, not {shape}")
    return width


def enhanced(weights: Mapping[str, Tensor], colour: Tensor) -> Tensor:
    """An improved image [H, W, 3] of any size, display-referred, not clamped. Differentiable in everything.

    `weights` holds the tensors named WEIGHTS; others are ignored. Raises ValueError for weights of another shape.
    """
    network = layers(width_of(weights))

    def convolved(name: str, x: Tensor) -> Tensor:
        layer, kernel, bias = network[name], weights[weight_name(name)], weights[bias_name(name)]
        if layer.up:
            return functional.conv_transpose2d(x, kernel, bias, layer.stride)
        return functional.conv2d(x, kernel, bias, layer.stride, layer.padding)

    def activated(name: str, x: Tensor) -> Tensor:
        return functional.relu(convolved(name, x))

    height, width = colour.shape[:2]
    beyond = (0, -width % MULTIPLE, 0, -height % MULTIPLE)  # right and below
    raw = functional.pad(colour.permute(2, 0, 1)[None], beyond, mode="replicate")
    half = activated("half_in", activated("half_down", raw))
    quarter = activated("quarter_in", activated("quarter_down", half))
    eighth = activated("eighth_out", activated("eighth_in", activated("eighth_down", quarter)))
    back = activated("quarter_out", torch.cat([quarter, convolved("quarter_up", eighth)], dim=1))
    back = activated("half_out", torch.cat([half, convolved("half_up", back)], dim=1))
    back = activated("full_out", torch.cat([raw, convolved("full_up", back)], dim=1))
    better = raw + convolved("correction", back)
    return better[0, :, :height, :width].permute(1, 2, 0)
