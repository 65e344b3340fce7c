"""Point splatting by Numba kernels, float32: its image, and its gradients by hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from avatar_runtime import F32, I32, I64, U32, Camera, RasterSettings
from avatar_runtime.backends.cpu import read_only, using
from avatar_runtime.backends.cpu.draw import sort, tile_lists
from avatar_trainer.raster.cpu import started
from avatar_trainer.raster.points_geometry import project_points, project_points_backward
from avatar_trainer.raster.points_kernels import BAND, COLUMNS, ROW, composite_bands, composite_bands_backward
from avatar_trainer.tensors import Points, Rendered


@dataclass(frozen=True)
class View:
    """The inputs of an image besides tensors, as the kernels take them."""

    camera_from_world: F32
    clip_from_world: F32
    lens: F32  # [2] focal_x pixels, near
    width: int
    height: int
    workers: int

    @staticmethod
    def of(camera: Camera, settings: RasterSettings, workers: int) -> View:
        """The arrays of a camera; `settings` gives the near plane."""
        focal_x = np.float32(camera.width) / (np.float32(2) * np.float32(camera.tan_half_fov_x))
        return View(
            read_only(camera.camera_from_world),
            read_only(camera.clip_from_world),
            read_only(np.array([focal_x, settings.near])),
            camera.width,
            camera.height,
            workers,
        )


@dataclass(frozen=True)
class Drawn:
    """The values of the forward pass that backward needs besides its inputs."""

    discs: F32  # [N, COLUMNS]
    bands: I32  # [N, 4]
    first_row: I64  # [N + 1]
    members: U32  # [P] discs, band by band, front to back
    starts: I64  # [bands + 1]
    transmittance: F32  # [H, W]
    last: F32  # [H, W]


def rasterise(
    points: Points,
    camera: Camera,
    settings: RasterSettings,
    background: Tensor,
    screen_offset: Tensor | None,
    threads: int | None,
) -> Rendered:
    """As `points.rasterise`; raises TypeError for tensors that are not float32."""
    offset = points.mean.new_zeros((0, 2)) if screen_offset is None else screen_offset
    tensors = (points.mean, points.radius, points.opacity, points.rgb, background, offset)
    if any(tensor.dtype != torch.float32 or tensor.device.type != "cpu" for tensor in tensors):
        raise TypeError("the kernels of point splatting take float32 tensors on the CPU")
    view = View.of(camera, settings, started(threads))
    return Rendered(*_Draw.apply(*tensors, view))  # type: ignore[no-untyped-call]


class _Draw(torch.autograd.Function):
    """Points to colour, alpha, radius and visibility."""

    @staticmethod
    def forward(
        ctx: Any,
        mean: Tensor,
        radius: Tensor,
        opacity: Tensor,
        rgb: Tensor,
        background: Tensor,
        offset: Tensor,
        view: View,
    ) -> tuple[Tensor, ...]:
        inputs = (_array(mean), _array(radius), _array(opacity), _array(rgb), _array(offset))
        with using(view.workers):
            drawn, colour, reach, weight = _draw(inputs, _array(background), view)
        ctx.save_for_backward(mean, radius, background)
        ctx.drawn, ctx.view, ctx.moved = drawn, view, bool(len(offset))
        alpha = torch.from_numpy(1 - drawn.transmittance)
        counts = (torch.from_numpy(reach), torch.from_numpy(_largest(weight, drawn.first_row)))
        ctx.mark_non_differentiable(*counts)
        return torch.from_numpy(colour), alpha, *counts

    @staticmethod
    @once_differentiable
    def backward(
        ctx: Any, grad_colour: Tensor, grad_alpha: Tensor, *grad_counts: Tensor
    ) -> tuple[Tensor | None, ...]:
        mean, radius, background = ctx.saved_tensors
        with using(ctx.view.workers):
            rows = _composite_backward(
                ctx.drawn, ctx.view, _array(background), _array(grad_colour), _array(grad_alpha)
            )
        gradients = _project_backward(_array(mean), _array(radius), ctx.drawn, ctx.view, rows)
        *grad_points, grad_centre = map(torch.from_numpy, gradients)
        left = torch.from_numpy(ctx.drawn.transmittance)
        grad_background = (left[..., None].double() * grad_colour).sum(dim=(0, 1)).float()
        return (*grad_points, grad_background, grad_centre if ctx.moved else None, None)


def _array(tensor: Tensor) -> F32:
    return read_only(tensor.detach().numpy())


def _draw(inputs: tuple[F32, F32, F32, F32, F32], background: F32, view: View) -> tuple[Drawn, F32, I32, F32]:
    """(values that backward needs, image [H, W, 3], radius [N] on the screen, largest weight of each row [P])."""
    n, bands = len(inputs[0]), -(-view.height // BAND)
    discs, depth = np.empty((n, COLUMNS), np.float32), np.empty(n, np.float32)
    reach, touched, counts = np.empty(n, np.int32), np.zeros((n, 4), np.int32), np.zeros(bands, np.int64)
    project_points(
        *inputs,
        view.camera_from_world,
        view.clip_from_world,
        view.lens,
        view.width,
        view.height,
        discs,
        depth,
        reach,
        touched,
        counts,
    )
    members, starts = tile_lists(touched, sort(depth, reach), counts, 1, view.workers)
    first_row = np.zeros(n + 1, np.int64)
    np.cumsum(touched[:, 3] - touched[:, 1], out=first_row[1:])
    shape = (view.height, view.width)
    colour, transmittance = np.empty((*shape, 3), np.float32), np.empty(shape, np.float32)
    last, weight = np.empty(shape, np.float32), np.empty(len(members), np.float32)
    composite_bands(
        discs,
        touched,
        first_row,
        members,
        starts,
        background,
        view.workers,
        colour,
        transmittance,
        last,
        weight,
    )
    return Drawn(discs, touched, first_row, members, starts, transmittance, last), colour, reach, weight


def _largest(weight: F32, first_row: I64) -> F32:
    """[N] the largest of each disc's rows; 0 without rows."""
    result = np.zeros(len(first_row) - 1, np.float32)
    some = first_row[1:] > first_row[:-1]
    if some.any():
        result[some] = np.maximum.reduceat(weight, first_row[:-1][some])
    return result


def _composite_backward(drawn: Drawn, view: View, background: F32, grad_colour: F32, grad_alpha: F32) -> F32:
    rows = np.empty((len(drawn.members), ROW), np.float32)
    composite_bands_backward(
        drawn.discs,
        drawn.bands,
        drawn.first_row,
        drawn.members,
        drawn.starts,
        drawn.transmittance,
        drawn.last,
        grad_colour,
        read_only(grad_colour @ background - grad_alpha),
        view.workers,
        rows,
    )
    return rows


def _project_backward(mean: F32, radius: F32, drawn: Drawn, view: View, rows: F32) -> tuple[F32, ...]:
    """Gradients of mean, radius, opacity, rgb and centres (pixels)."""
    n = len(mean)
    of = tuple(np.empty(shape, np.float32) for shape in ((n, 3), (n,), (n,), (n, 3), (n, 2)))
    project_points_backward(
        mean,
        radius,
        view.camera_from_world,
        view.clip_from_world,
        view.lens,
        view.width,
        view.height,
        drawn.discs,
        drawn.first_row,
        rows,
        *of,
    )
    return of
