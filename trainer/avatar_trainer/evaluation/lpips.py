"""LPIPS (Zhang et al. 2018): the distance of two images in the features of a network, computed from a weights file.

The weights belong to others (the linear layers: BSD-2; the networks: torchvision, trained on ImageNet) and are not
part of this project, and nothing is downloaded. A file holds all of them; MAKE writes it on a machine that has them.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import torch
import torch.nn.functional as F
from torch import Tensor

from avatar_runtime import AvatarError

MAKE = "python -c \"import lpips, torch; torch.save(lpips.LPIPS(net='vgg').state_dict(), 'lpips_vgg.pth')\""
LAYERS = 5
MAX_FILE_BYTES = 1 << 30
SMALLEST = {"alex": 63, "vgg": 16}  # pixels of the shorter side that the network can take
CONVOLUTION = re.compile(r"net\.slice([1-5])\.(\d{1,2})\.(weight|bias)")
# of images from -1 to 1, before the network
SHIFT, SCALE = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)
TINY = 1e-10  # beside the length of a pixel's features


@dataclass(frozen=True)
class Convolution:
    """A convolution, after which negative values become 0."""

    weight: Tensor  # [out, in, k, k]
    bias: Tensor  # [out]
    stride: int
    padding: int


class Lpips:
    """LPIPS version 0.1 by the network whose weights a file holds: AlexNet or VGG16."""

    def __init__(self, path: Path) -> None:
        """Read the weights. Raises AvatarError for a file that does not hold those of one of the two networks."""
        state = _state(path)
        first = state.get("net.slice1.0.weight")
        if first is None or first.ndim != 4:
            raise _wrong("has no net.slice1.0.weight", path)
        self.network = "alex" if first.shape[-1] == 11 else "vgg"
        self._slices = [_convolutions(state, layer, self.network, path) for layer in range(1, LAYERS + 1)]
        self._linear = [_linear(state, layer, self._slices[layer][-1], path) for layer in range(LAYERS)]

    @torch.no_grad()
    def __call__(self, a: Tensor, b: Tensor) -> float:
        """The distance of two images [H, W, 3], 0..1. Raises ValueError for images too small for the network."""
        if min(a.shape[:2]) < SMALLEST[self.network]:
            raise ValueError(f"LPIPS by {self.network} needs {SMALLEST[self.network]} pixels a side")
        total = 0.0
        pairs = zip(self._features(a), self._features(b), self._linear, strict=True)
        for x, y, weight in pairs:
            total += float((weight[:, None, None] * (_unit(x) - _unit(y)) ** 2).sum(0).mean())
        return total

    def _features(self, image: Tensor) -> list[Tensor]:
        """[C, h, w] behind each of the five slices."""
        shift, scale = torch.tensor(SHIFT)[:, None, None], torch.tensor(SCALE)[:, None, None]
        values = ((2 * image.permute(2, 0, 1).float() - 1 - shift) / scale)[None]
        found = []
        for layer, convolutions in enumerate(self._slices):
            if self.network == "vgg" and layer > 0:
                values = F.max_pool2d(values, 2, 2)
            elif self.network == "alex" and layer in (1, 2):
                values = F.max_pool2d(values, 3, 2)
            for c in convolutions:
                values = F.conv2d(values, c.weight, c.bias, c.stride, c.padding).relu()
            found.append(values[0])
        return found


def _unit(features: Tensor) -> Tensor:
    return features / (features.square().sum(0, keepdim=True).sqrt() + TINY)


def _state(path: Path) -> Mapping[str, Tensor]:
    try:
        if path.stat().st_size > MAX_FILE_BYTES:
            raise _wrong(f"is longer than {MAX_FILE_BYTES} bytes", path)
        state = torch.load(path, map_location="cpu", weights_only=True)
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from None
    except AvatarError:
        raise
    except Exception:  # torch names no exceptions: a foreign file gives any
        raise _wrong("is not a file of torch.save with tensors alone", path) from None
    if not isinstance(state, dict) or not all(isinstance(value, Tensor) for value in state.values()):
        raise _wrong("does not hold tensors by name", path)
    return {str(name): value.float() for name, value in state.items()}


def _convolutions(state: Mapping[str, Tensor], layer: int, network: str, path: Path) -> list[Convolution]:
    matches = filter(None, map(CONVOLUTION.fullmatch, state))
    places = sorted({int(match[2]) for match in matches if int(match[1]) == layer})
    found = []
    for place in places:
        name = f"net.slice{layer}.{place}"
        weight, bias = state.get(f"{name}.weight"), state.get(f"{name}.bias")
        if weight is None or bias is None or weight.ndim != 4 or bias.shape != weight.shape[:1]:
            raise _wrong(f"has no convolution {name}", path)
        stride = 4 if network == "alex" and layer == 1 else 1
        padding = 2 if network == "alex" and layer <= 2 else 1
        found.append(Convolution(weight, bias, stride, padding))
    if not found:
        raise _wrong(f"has no net.slice{layer}", path)
    return found


def _linear(state: Mapping[str, Tensor], layer: int, last: Convolution, path: Path) -> Tensor:
    """[C] weights of the squared differences of a layer's features."""
    weight = state.get(f"lin{layer}.model.1.weight")
    if weight is None or weight.numel() != len(last.bias):
        raise _wrong(f"has no lin{layer}.model.1.weight of {len(last.bias)} channels", path)
    return weight.flatten()


def _wrong(message: str, path: Path) -> AvatarError:
    return AvatarError(
        f"{message}; a file of LPIPS weights is made by {MAKE}", file=path, field="--lpips-weights"
    )
