"""The differentiable renderer: milliseconds of CPU time an image and its gradients, by Gaussians and resolution.

    python -m bench --only training
    python -m bench.training

One thread of rasteriser `cpu`, from splats to colour and back to every input. The scene is the shell of a head,
half of it turned away, with splats as large as their number leaves room for.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import torch

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_trainer.raster.renderer import render
from avatar_trainer.tensors import Splats
from bench.training_iterations import iteration_rows

Row = tuple[str, float, str]
COUNTS = (5_000, 10_000, 20_000, 50_000)
SIZES = (128, 256, 512)
ROUNDS = 9
RADII = (0.08, 0.12, 0.1)  # metres
SH_DEGREE = 1
OVERLAP = 0.6  # standard deviation of a splat over the width of its share of the surface


def training_rows(folder: Path, gaussians: int) -> list[Row]:
    """Forward and backward, and whole iterations."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        return [*_rows(), *iteration_rows(folder)]
    finally:
        torch.set_num_threads(before)


def _rows() -> Iterator[Row]:
    for size in SIZES:
        for count in COUNTS:
            forward, backward = timed(count, size)
            yield f"training_{count}_at_{size}_forward", forward, "ms"
            yield f"training_{count}_at_{size}_backward", backward, "ms"


def timed(count: int, size: int) -> tuple[float, float]:
    """Median CPU milliseconds (forward, backward) after one round that compiles and fills caches."""
    splats, camera = shell(count), Camera.orbit(np.zeros(3), 0.7, 0.2, 0.1, 0.45, size, size)
    inputs = [v for v in vars(splats).values() if v is not None]
    offset, background = torch.zeros(len(splats.mean), 2, requires_grad=True), torch.zeros(3)
    grad_colour = torch.randn(size, size, 3, generator=torch.Generator().manual_seed(1)) / size**2
    times = []
    for _ in range(ROUNDS + 1):
        start = time.process_time()
        rendered = render(
            splats, camera, RasterSettings(near=0.05), SH_DEGREE, background, "cpu", offset, threads=1
        )
        middle = time.process_time()
        torch.autograd.grad(rendered.colour, [*inputs, offset], grad_colour)
        times.append((middle - start, time.process_time() - middle))
    forward, backward = (1e3 * statistics.median(column) for column in zip(*times[1:], strict=True))
    return forward, backward


def shell(count: int) -> Splats:
    """`count` splats on an ellipsoid the size of a head."""
    generator = torch.Generator().manual_seed(0)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(shape, generator=generator)

    radii = torch.tensor(RADII)
    mean = torch.nn.functional.normalize(normal(count, 3), dim=1) * radii + 0.002 * normal(count, 3)
    spacing = float(np.sqrt(4 * np.pi * float(radii.square().mean()) / count))
    tensors = (
        mean,
        OVERLAP * spacing * torch.exp(0.4 * normal(count, 3)),
        torch.nn.functional.normalize(normal(count, 4), dim=1),
        torch.sigmoid(1.5 * normal(count)),
        0.3 * normal(count, (SH_DEGREE + 1) ** 2, 3),
    )
    return Splats(*(value.requires_grad_() for value in tensors))


def main() -> None:
    """Print the rows."""
    for what, value, unit in training_rows(Path(), 0):
        print(f"{what:44s} {value:10.4g} {unit}")


if __name__ == "__main__":
    main()
