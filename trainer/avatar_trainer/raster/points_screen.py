"""Points on the screen: the discs that every rasteriser of points composites."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avatar_runtime import Camera, RasterSettings
from avatar_schema import constants
from avatar_trainer.stages.project import affine, constant, like, screen_centre
from avatar_trainer.tensors import Points

# Pixels. The nearest pixel's centre is at most 0.71 away, so a point shows there with half its opacity or more.
LEAST_RADIUS = 1.0
ALPHA_MAX = constant(constants()["alpha_max"])  # as for Gaussians: no point is fully opaque
STOP = constant(
    constants()["transmittance_min"]
)  # a point that would leave less transmittance ends the pixel


@dataclass(frozen=True)
class Discs:
    """The points that are drawn, M of N."""

    index: Tensor  # [M] i64 which points they are, ascending
    centre: Tensor  # [M, 2] pixels, pixel centres at integers
    radius: Tensor  # [M] pixels, >= LEAST_RADIUS
    opacity: Tensor  # [M]
    rgb: Tensor  # [M, 3]
    depth: Tensor  # [M] view z, no gradient


def project(points: Points, camera: Camera, settings: RasterSettings, screen_offset: Tensor | None) -> Discs:
    """The discs of `points`: radius focal_x * radius / depth pixels, at least LEAST_RADIUS.

    A point is drawn if it lies beyond `settings.near` and its box of pixels meets the image. `screen_offset` [N, 2]
    pixels is added to the centres first. Differentiable.
    """
    with torch.no_grad():
        centre, radius, depth = _geometry(points.mean, points.radius, camera)
        if screen_offset is not None:
            centre = centre + screen_offset
        far_corner = centre.new_tensor([camera.width - 1, camera.height - 1])
        reach = radius[:, None]
        meets = ((centre + reach > 0) & (centre - reach < far_corner)).all(dim=1)
        drawn = meets & (depth > constant(settings.near)) & torch.isfinite(radius)
        index = torch.nonzero(drawn)[:, 0]
    centre, radius, depth = _geometry(
        points.mean.index_select(0, index), points.radius.index_select(0, index), camera
    )
    if screen_offset is not None:
        centre = centre + screen_offset.index_select(0, index)
    return Discs(
        index,
        centre,
        radius,
        points.opacity.index_select(0, index),
        points.rgb.index_select(0, index),
        depth.detach(),
    )


def _geometry(mean: Tensor, radius: Tensor, camera: Camera) -> tuple[Tensor, Tensor, Tensor]:
    """(centre [N, 2] pixels, radius [N] pixels, view z [N])."""
    depth = affine(like(camera.camera_from_world, mean), mean)[:, 2]
    focal_x = constant(camera.width / (2 * constant(camera.tan_half_fov_x)))
    on_screen = torch.clamp(focal_x * radius / depth, min=LEAST_RADIUS)
    return screen_centre(mean, camera), on_screen, depth
