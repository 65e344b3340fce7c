"""Rasteriser `torch`: stage `raster` of the `trainer` profile in plain tensor algebra; its gradients are autograd's.

The definition of the gradients, as `avatar_runtime.stages.raster` is of the image: any floating type, slow.
"""

from __future__ import annotations

import torch
from torch import Tensor

from avatar_runtime import Camera, RasterSettings
from avatar_runtime.stages import project as runtime_project
from avatar_runtime.stages import raster as runtime_raster
from avatar_schema import constants
from avatar_trainer.stages.project import Projected, constant, project
from avatar_trainer.stages.sort import sort
from avatar_trainer.tensors import Rendered, Splats

TILE = runtime_project.TILE


def rasterise(
    splats: Splats,
    camera: Camera,
    settings: RasterSettings,
    sh_degree: int,
    background: Tensor,
    screen_offset: Tensor | None,
    threads: int | None,
) -> Rendered:
    """`render` by tensors; `threads` has no effect."""
    projected = project(splats, camera, settings, sh_degree)
    centre = projected.centre if screen_offset is None else projected.centre + screen_offset
    colour, transmittance = raster(projected, centre, sort(projected), camera, background)
    return Rendered(colour, 1 - transmittance, projected.radius)


def raster(
    projected: Projected,
    centre: Tensor,  # [N, 2] where the splats are drawn; which tiles they touch is decided already
    order: Tensor,  # [drawn] ids, front to back
    camera: Camera,
    background: Tensor,  # [3]
) -> tuple[Tensor, Tensor]:
    """(colour [H, W, 3] over the background, transmittance [H, W])."""
    ids, ranges = runtime_raster.tile_lists(projected.tiles.numpy(), order.numpy(), camera, TILE)
    columns = -(-camera.width // TILE)
    rows = []
    for row in range(-(-camera.height // TILE)):
        drawn = []
        for column in range(columns):
            begin, end = ranges[row * columns + column]
            members = torch.from_numpy(ids[begin:end])
            drawn.append(_tile(projected, centre, members, column * TILE, row * TILE))
        rows.append(torch.cat(drawn, dim=1))
    image = torch.cat(rows)[: camera.height, : camera.width]
    colour, transmittance = image[..., :3], image[..., 3]
    return colour + transmittance[..., None] * background, transmittance


def _tile(projected: Projected, centre: Tensor, members: Tensor, x0: int, y0: int) -> Tensor:
    """[TILE, TILE, 4] colour and transmittance of the splats `members`, front to back, at (x0, y0)."""
    alpha = _alpha(projected, centre, members, x0, y0)
    with torch.no_grad():  # a splat that would leave less transmittance than the minimum ends the pixel
        stays = torch.cumprod(1 - alpha, dim=0) >= constant(constants()["transmittance_min"])
    alpha = torch.where(stays, alpha, 0)
    after = torch.cumprod(torch.cat([alpha.new_ones((1, alpha.shape[1])), 1 - alpha]), dim=0)
    colour = torch.einsum("cp,ck->pk", alpha * after[:-1], projected.rgb[members])
    return torch.cat([colour, after[-1, :, None]], dim=1).reshape(TILE, TILE, 4)


def _alpha(projected: Projected, centre: Tensor, members: Tensor, x0: int, y0: int) -> Tensor:
    """[C, TILE * TILE] min(0.99, o e^p), 0 where the exponent is positive or alpha is below 1/255."""
    pixel = torch.arange(TILE, dtype=centre.dtype)
    x, y = (x0 + pixel).repeat(TILE), (y0 + pixel).repeat_interleave(TILE)
    dx, dy = centre[members, 0, None] - x, centre[members, 1, None] - y
    a, b, c = (projected.conic[members, k, None] for k in range(3))
    power = -0.5 * (a * dx * dx + c * dy * dy) - b * dx * dy
    # A positive exponent (only of an indefinite conic) would overflow before it is skipped.
    alpha = projected.opacity[members, None] * torch.exp(torch.clamp(power, max=0))
    alpha = torch.clamp(alpha, max=constant(constants()["alpha_max"]))
    least = constant(1 / constants()["alpha_min_denominator"])
    return torch.where((power <= 0) & (alpha >= least), alpha, 0)
