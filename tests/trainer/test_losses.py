"""Losses and measures: against loops over pixels and points, and gradients that agree with differences."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from types import ModuleType

import numpy as np
import numpy.typing as npt
import pytest
import torch
from torch import Tensor
from torch.autograd import gradcheck

from avatar_trainer import losses
from avatar_trainer.losses import Cylinder
from tests.trainer.tensors import leaves, normal

Array = npt.NDArray[np.float64]


def image(seed: int, height: int = 13, width: int = 9) -> Tensor:
    return torch.sigmoid(normal(seed, height, width, 3))


def ssim_by_loops(a: Array, b: Array) -> float:
    """Wang et al. 2004, Eq. 13, one window at a time; pixels outside the image are 0."""
    offsets = range(-5, 6)
    weight = {(i, j): math.exp(-(i * i + j * j) / (2 * 1.5 * 1.5)) for i in offsets for j in offsets}
    total = sum(weight.values())
    height, width, channels = a.shape
    values = []
    for y in range(height):
        for x in range(width):
            for c in range(channels):
                pairs = [
                    (w / total, a[y + i, x + j, c], b[y + i, x + j, c])
                    if 0 <= y + i < height and 0 <= x + j < width
                    else (w / total, 0.0, 0.0)
                    for (i, j), w in weight.items()
                ]
                ma, mb = sum(w * p for w, p, _ in pairs), sum(w * q for w, _, q in pairs)
                va, vb = (
                    sum(w * (p - ma) ** 2 for w, p, _ in pairs),
                    sum(w * (q - mb) ** 2 for w, _, q in pairs),
                )
                cov = sum(w * (p - ma) * (q - mb) for w, p, q in pairs)
                luminance = (2 * ma * mb + 0.01**2) / (ma * ma + mb * mb + 0.01**2)
                values.append(luminance * (2 * cov + 0.03**2) / (va + vb + 0.03**2))
    return float(np.mean(values))


def test_ssim_against_loops() -> None:
    a, b = image(0), image(1)
    expected = ssim_by_loops(a.numpy(), b.numpy())
    assert abs(float(losses.ssim(a, b)) - expected) <= 1e-12
    assert abs(float(losses.ssim(a.float(), b.float())) - expected) <= 1e-6
    assert abs(float(losses.dssim_loss(a, b)) - (1 - expected)) <= 1e-12


def test_l1_and_psnr() -> None:
    a, b = image(0), image(1)
    difference = a.numpy() - b.numpy()
    assert float(losses.l1(a, b)) == pytest.approx(float(np.abs(difference).mean()), rel=1e-12)
    assert losses.psnr_db(a, b) == pytest.approx(
        10 * math.log10(1 / float((difference**2).mean())), rel=1e-12
    )
    assert losses.psnr_db(a, a) == math.inf
    assert losses.psnr_db(torch.zeros(4, 4, 3), torch.full((4, 4, 3), 0.1)) == pytest.approx(20, abs=1e-5)


def cylinder(dtype: torch.dtype = torch.float64) -> Cylinder:
    axis = torch.nn.functional.normalize(torch.tensor([0.2, -0.5, 1.0], dtype=dtype), dim=0)
    return Cylinder(torch.tensor([0.1, -0.2, 0.3], dtype=dtype), axis, 0.4, 0.7)


def distance(point: Array, c: Cylinder) -> float:
    """To the nearest point of the solid, found by turning the cylinder upright."""
    axis = c.axis.numpy()
    across = np.linalg.svd(axis[None])[2][1:]  # two directions square to it
    offset = point - c.centre.numpy()
    x, y, z = float(across[0] @ offset), float(across[1] @ offset), float(axis @ offset)
    shrink = min(1.0, c.radius / max(math.hypot(x, y), 1e-300))
    nearest = (x * shrink, y * shrink, max(-c.half_length, min(c.half_length, z)))
    return math.dist((x, y, z), nearest)


def test_mouth_volume_loss() -> None:
    points, c = 0.6 * normal(0, 200, 3), cylinder()
    apart = [distance(p, c) for p in points.numpy()]
    assert sum(d == 0 for d in apart) > 10
    expected = float(np.mean(np.square(apart)))
    assert float(losses.mouth_volume_loss(points, c)) == pytest.approx(expected, rel=1e-12)


def test_scaling_loss() -> None:
    scale = torch.tensor(
        [[0.1, 0.02, 0.05], [0.1, 0.005, 0.05], [0.007, 0.0001, 0.001], [0.02, 0.002, 0.019]]
    )
    # long above 0.008, thin above 10 : 1. 5 : 1; 20 : 1; 70 : 1 but short; 10 : 1 is not above
    assert float(losses.scaling_loss(scale, 0.008, 10.0)) == pytest.approx(0.1 / 4)
    (leaf,) = leaves([scale])
    losses.scaling_loss(leaf, 0.008, 10.0).backward()
    assert leaf.grad is not None and leaf.grad.tolist() == [[0, 0, 0], [0.25, 0, 0], [0, 0, 0], [0, 0, 0]]
    assert gradcheck(lambda s: losses.scaling_loss(s, 0.3, 2.0), leaves([normal(2, 20, 3).exp()]))


@pytest.fixture
def no_network() -> Iterator[None]:
    losses._lpips.cache_clear()
    yield
    losses._lpips.cache_clear()


@pytest.mark.usefixtures("no_network")
def test_lpips_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lpips", None)
    with pytest.raises(RuntimeError, match=r"^the LPIPS loss needs the package lpips: pip install lpips$"):
        losses.lpips_loss(torch.zeros(8, 8, 3), torch.zeros(8, 8, 3))


@pytest.mark.usefixtures("no_network")
def test_lpips_gets_one_image_each_from_minus_1_to_1(monkeypatch: pytest.MonkeyPatch) -> None:
    class LPIPS(torch.nn.Module):
        def __init__(self, net: str, verbose: bool) -> None:
            super().__init__()
            assert (net, verbose) == ("vgg", False)

        def forward(self, a: Tensor, b: Tensor) -> Tensor:
            assert a.shape == b.shape == (1, 3, 8, 9)
            return (a - b).sum(dim=(1, 2, 3), keepdim=True)

    package = ModuleType("lpips")
    package.LPIPS = LPIPS
    monkeypatch.setitem(sys.modules, "lpips", package)
    value = losses.lpips_loss(torch.ones(8, 9, 3), torch.zeros(8, 9, 3))
    assert value.dim() == 0 and float(value) == 2 * 8 * 9 * 3
