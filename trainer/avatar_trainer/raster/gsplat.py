"""Rasteriser `gsplat`: the CUDA kernels of gsplat, to train faster; a profile of its own.

It culls and clamps differently from `trainer` and normalises quaternions, so no reference image is made with it.
Colour is computed by the tensor twin of stage `project`, since gsplat has no sh_rotation. Never run: it was written
from gsplat's documentation of `rasterization`, without a machine with CUDA.
"""

from __future__ import annotations

import importlib.util
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import AvatarError, Camera, RasterSettings
from avatar_trainer.stages.project import splat_colour
from avatar_trainer.tensors import Rendered, Splats


def rasterise(
    splats: Splats,
    camera: Camera,
    settings: RasterSettings,
    sh_degree: int,
    background: Tensor,
    screen_offset: Tensor | None,
    threads: int | None,
) -> Rendered:
    """`render` by gsplat; other tensors are copied to the GPU and back. `threads` has no effect.

    The gradient of `screen_offset` is gsplat's of the projected centres; its values are not added to anything.
    Raises AvatarError without gsplat or CUDA.
    """
    expect_gsplat()
    from gsplat import rasterization

    home, there = splats.mean.device, _moved(splats)
    colour, alpha, about = rasterization(
        there.mean,
        there.quat_wxyz,
        there.scale,
        there.opacity,
        splat_colour(there, camera, sh_degree),
        torch.tensor(camera.camera_from_world, device="cuda")[None],
        torch.tensor(intrinsics(camera), device="cuda")[None],
        camera.width,
        camera.height,
        near_plane=settings.near,
        eps2d=settings.low_pass,
        packed=False,
        backgrounds=background.cuda()[None],
    )
    if screen_offset is not None and screen_offset.requires_grad:
        about["means2d"].register_hook(lambda gradient: _keep(gradient, screen_offset))
    radii = about["radii"][0]
    radius = (radii if radii.ndim == 1 else radii.amax(dim=1)).to(home, torch.int32)
    return Rendered(colour[0].to(home), alpha[0, ..., 0].to(home), radius)


def intrinsics(camera: Camera) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    """K [3, 3] in pixels, pixel centres at half integers."""
    projection = camera.clip_from_world.astype(np.float64) @ np.linalg.inv(
        camera.camera_from_world.astype(np.float64)
    )
    half_width, half_height = camera.width / 2, camera.height / 2
    k = np.eye(3)
    k[0] = projection[0, 0] * half_width, projection[0, 1] * half_width, (projection[0, 2] + 1) * half_width
    k[1, 1:] = projection[1, 1] * half_height, (projection[1, 2] + 1) * half_height
    return k.astype(np.float32)


def expect_gsplat() -> None:
    """Raise AvatarError without gsplat or CUDA."""
    if importlib.util.find_spec("gsplat") is None:
        raise AvatarError("needs gsplat: pip install gsplat", field="rasteriser gsplat")
    if not torch.cuda.is_available():
        raise AvatarError("needs a GPU with CUDA and a torch built for it", field="rasteriser gsplat")


def _moved(splats: Splats) -> Splats:
    rotation = splats.sh_rotation
    return replace(
        splats,
        mean=splats.mean.cuda(),
        scale=splats.scale.cuda(),
        quat_wxyz=splats.quat_wxyz.cuda(),
        opacity=splats.opacity.cuda(),
        sh=splats.sh.cuda(),
        sh_rotation=None if rotation is None else rotation.cuda(),
    )


def _keep(gradient: Tensor, offset: Tensor) -> None:
    """Add gsplat's gradient [1, N, 2] of the centres to the offset's."""
    here = gradient.detach()[0].to(offset.device, offset.dtype)
    offset.grad = here if offset.grad is None else offset.grad + here
