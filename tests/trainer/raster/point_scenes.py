"""Small scenes for point splatting, and gradients with respect to every input."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_trainer.raster.points import rasterise
from avatar_trainer.tensors import Points, Rendered
from tests.trainer.raster.scenes import camera, loss

INPUTS = ("mean", "radius", "opacity", "rgb", "background", "screen_offset")


@dataclass(frozen=True)
class PointScene:
    """Inputs in the order of `INPUTS`, float64 with values that float32 has, and the camera that sees them."""

    inputs: tuple[Tensor, ...]
    camera: Camera

    def leaves(self, dtype: torch.dtype) -> list[Tensor]:
        """The inputs, ready for gradients."""
        return [value.to(dtype).clone().requires_grad_() for value in self.inputs]


def scene(
    seed: int,
    count: int,
    size: tuple[int, int] = (24, 20),
    *,
    radius: float = 0.06,
    opacity: tuple[float, float] = (0.05, 0.95),
    spread: float = 0.2,
) -> PointScene:
    """`count` random points about the origin, two metres away; some partly or wholly outside the image."""
    generator = torch.Generator().manual_seed(seed)

    def uniform(*shape: int) -> Tensor:
        return torch.rand(shape, generator=generator, dtype=torch.float64)

    normal = torch.randn(count, 3, generator=generator, dtype=torch.float64)
    low, high = opacity
    values = (
        spread * normal,
        radius * (0.5 + 1.5 * uniform(count)),
        low + (high - low) * uniform(count),
        uniform(count, 3),
        uniform(3),
        uniform(count, 2) - 0.5,
    )
    return PointScene(tuple(value.float().double() for value in values), camera(*size))


def harsh() -> PointScene:
    """Not drawn, clamped or stopped points: behind, before the near plane, outside, beta 1 on a pixel, tiny, huge."""
    of = scene(7, 80, (70, 50), radius=0.05, opacity=(0.9, 1.0))
    mean, radius, opacity = (value.clone() for value in of.inputs[:3])
    view = torch.tensor(of.camera.camera_from_world, dtype=torch.float64)
    eye, forward, right = torch.tensor(of.camera.centre, dtype=torch.float64), view[2, :3], view[0, :3]
    mean[0], mean[1], mean[2] = eye - 0.5 * forward, eye + 0.15 * forward, 40 * right
    mean[10:30] *= 0.2  # one behind the other: the stop
    opacity[10:60] = 1
    radius[60:70] = 1e-4  # the least radius
    radius[3] = 2.0  # beyond the image on every side
    return PointScene(tuple(v.float().double() for v in (mean, radius, opacity)) + of.inputs[3:], of.camera)


def drawn(of: PointScene, inputs: list[Tensor], threads: int | None = 1) -> Rendered:
    """The scene with `inputs` in the place of its own."""
    *points, background, offset = inputs
    return rasterise(Points(*points), of.camera, RasterSettings(), background, offset, threads)


def gradients(of: PointScene, dtype: torch.dtype, threads: int | None = 1) -> dict[str, Tensor]:
    """Of `loss` with respect to each input."""
    inputs = of.leaves(dtype)
    loss(drawn(of, inputs, threads)).backward()
    return {name: leaf.grad for name, leaf in zip(INPUTS, inputs, strict=True) if leaf.grad is not None}
