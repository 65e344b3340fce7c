"""Point splatting (PSAvatar Eq. 3): discs that face the camera, alpha = beta (1 - r^2 / R^2).

r is the distance in pixels from a point's place on the screen to the pixel's centre, R = focal_x radius / depth, at
least `points_screen.LEAST_RADIUS`. Points are composited front to back by view z, ties by id, like Gaussians: alpha is
at most 0.99, and a point that would leave less transmittance than 1e-4 ends the pixel without being added. Alpha falls
to 0 at R, so there is no minimum of alpha.
"""

from __future__ import annotations

import torch
from torch import Tensor

from avatar_runtime import Camera, RasterSettings
from avatar_trainer.raster import points_cpu, points_definition
from avatar_trainer.raster.points_screen import project
from avatar_trainer.tensors import Points, Rendered


def rasterise(
    points: Points,
    camera: Camera,
    settings: RasterSettings,
    background: Tensor,  # [3] display-referred
    screen_offset: Tensor | None = None,  # [N, 2] pixels
    threads: int | None = None,
) -> Rendered:
    """The image of `points`: float32 by Numba kernels, any other type by the definition.

    Differentiable in the points, the background and the offset, which is added to the projected centres.
    `Rendered.visibility` [N] is each point's largest weight alpha T at any pixel, `radius` [N] its R rounded up, both 0
    where a point is not drawn. `threads`: as for `raster.renderer.render`; they do not change the result. Raises
    ValueError for shapes that do not fit together.
    """
    _check(points, background, screen_offset)
    if points.mean.dtype == torch.float32:
        return points_cpu.rasterise(points, camera, settings, background, screen_offset, threads)
    discs = project(points, camera, settings, screen_offset)
    colour, transmittance, largest = points_definition.composite(discs, camera, background)
    visibility = torch.zeros_like(points.opacity, requires_grad=False)
    visibility[discs.index] = largest
    radius = torch.zeros(len(points.mean), dtype=torch.int32)
    radius[discs.index] = torch.ceil(discs.radius.detach()).to(torch.int32)
    return Rendered(colour, 1 - transmittance, radius, visibility)


def _check(points: Points, background: Tensor, screen_offset: Tensor | None) -> None:
    n = len(points.mean)
    expected: list[tuple[str, Tensor | None, tuple[int, ...]]] = [
        ("mean", points.mean, (n, 3)),
        ("radius", points.radius, (n,)),
        ("opacity", points.opacity, (n,)),
        ("rgb", points.rgb, (n, 3)),
        ("background", background, (3,)),
        ("screen_offset", screen_offset, (n, 2)),
    ]
    for name, tensor, shape in expected:
        if tensor is not None and tuple(tensor.shape) != shape:
            raise ValueError(f"{name} is {tuple(tensor.shape)}, not {shape}")
