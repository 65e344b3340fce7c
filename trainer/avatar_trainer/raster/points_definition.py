"""The definition of point splatting in plain tensor algebra; its gradients are autograd's. Any floating type, slow."""

from __future__ import annotations

import torch
from torch import Tensor

from avatar_runtime import Camera
from avatar_trainer.raster.points_screen import ALPHA_MAX, STOP, Discs


def composite(discs: Discs, camera: Camera, background: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """(colour [H, W, 3] over the background, transmittance [H, W], largest weight [M] of each disc, no gradient).

    Every disc meets every pixel: memory M H W.
    """
    order = torch.argsort(discs.depth, stable=True)  # ties by id
    x, y = (torch.arange(size, dtype=discs.centre.dtype) for size in (camera.width, camera.height))
    dx = discs.centre[order, 0, None, None] - x[None, None, :]
    dy = discs.centre[order, 1, None, None] - y[None, :, None]
    radius = discs.radius[order, None, None]
    fall = torch.clamp(1 - (dx * dx + dy * dy) / (radius * radius), min=0)
    alpha = torch.clamp(discs.opacity[order, None, None] * fall, max=ALPHA_MAX)
    with torch.no_grad():
        stays = torch.cumprod(1 - alpha, dim=0) >= STOP
    alpha = torch.where(stays, alpha, 0)
    after = torch.cumprod(torch.cat([alpha.new_ones((1, *alpha.shape[1:])), 1 - alpha]), dim=0)
    weight, transmittance = alpha * after[:-1], after[-1]
    colour = torch.einsum("mhw,mk->hwk", weight, discs.rgb[order]) + transmittance[..., None] * background
    largest = torch.empty_like(discs.depth)
    largest[order] = weight.detach().amax(dim=(1, 2))
    return colour, transmittance, largest
