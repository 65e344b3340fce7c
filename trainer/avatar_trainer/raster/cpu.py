"""Rasteriser `cpu`: forward by the runtime's kernels, backward by hand-written gradients; float32."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from avatar_runtime import F32, I32, I64, U32, Camera, RasterSettings
from avatar_runtime import Splats as RuntimeSplats
from avatar_runtime.backends.cpu import read_only, thread_count, using
from avatar_runtime.backends.cpu.draw import (
    CENTRE_X,
    CENTRE_Y,
    STOP,
    TILE,
    Screen,
    composite_tiles,
    project,
    sort,
    tile_lists,
)
from avatar_trainer.raster.composite_backward import ROW, composite_tiles_backward
from avatar_trainer.raster.project_backward import SplatArrays, ViewArrays, project_splats_backward
from avatar_trainer.tensors import Rendered, Splats

PROFILE = "trainer"


@dataclass(frozen=True)
class View:
    """The inputs of an image besides tensors."""

    camera: Camera
    settings: RasterSettings
    sh_degree: int
    threads: int


@dataclass(frozen=True)
class Drawn:
    """The values of the forward pass that backward needs besides its inputs."""

    screen: Screen
    members: U32  # [P] ids, tile by tile, front to back
    starts: I64  # [tiles + 1]
    transmittance: F32  # [H, W]
    last: I32  # [H, W]


def rasterise(
    splats: Splats,
    camera: Camera,
    settings: RasterSettings,
    sh_degree: int,
    background: Tensor,
    screen_offset: Tensor | None,
    threads: int | None,
) -> Rendered:
    """`render` by Numba kernels: the image that the runtime's backend `cpu` draws, to the bit.

    Raises TypeError for tensors that are not float32.
    """
    offset = splats.mean.new_zeros((0, 2)) if screen_offset is None else screen_offset
    fields = vars(splats).values()
    tensors = [tensor for tensor in (*fields, background, offset) if tensor is not None]
    if any(tensor.dtype != torch.float32 or tensor.device.type != "cpu" for tensor in tensors):
        raise TypeError("rasteriser cpu takes float32 tensors on the CPU; torch takes others")
    view = View(camera, settings, sh_degree, started(threads))
    colour, alpha, radius = _Draw.apply(view, background, offset, *fields)  # type: ignore[no-untyped-call]
    return Rendered(colour, alpha, radius)


def started(threads: int | None) -> int:
    """`thread_count`, with Numba's threads started: with OpenMP that also sets torch's number, once."""
    of_torch = torch.get_num_threads()
    numba.get_num_threads()
    if torch.get_num_threads() != of_torch:
        torch.set_num_threads(of_torch)
    return thread_count(threads)


class _Draw(torch.autograd.Function):
    """From the fields of `Splats` to colour and alpha: autograd follows tensors, not structures."""

    @staticmethod
    def forward(
        ctx: Any, view: View, background: Tensor, offset: Tensor, *fields: Tensor | None
    ) -> tuple[Tensor, Tensor, Tensor]:
        with using(view.threads):
            drawn, colour = _draw(_arrays(fields), _array(background), _array(offset), view)
        ctx.save_for_backward(background, *fields)
        ctx.drawn, ctx.view, ctx.moved = drawn, view, bool(len(offset))
        radius = torch.from_numpy(
            drawn.screen.radius.copy()
        )  # the caller may change them before backward reads them
        ctx.mark_non_differentiable(radius)
        return torch.from_numpy(colour), torch.from_numpy(1 - drawn.transmittance), radius

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, grad_colour: Tensor, grad_alpha: Tensor, _: Tensor) -> tuple[Tensor | None, ...]:
        background, *fields = ctx.saved_tensors
        image = (_array(grad_colour), _array(grad_alpha))
        with using(ctx.view.threads):
            grad, grad_centre = _draw_backward(
                _arrays(fields), _array(background), ctx.drawn, ctx.view, *image
            )
        grad_background = None
        if ctx.needs_input_grad[1]:
            behind = torch.from_numpy(ctx.drawn.transmittance)
            grad_background = (behind[..., None].double() * grad_colour).sum(dim=(0, 1)).float()
        grad_offset = torch.from_numpy(grad_centre) if ctx.moved else None
        return None, grad_background, grad_offset, *map(torch.from_numpy, grad), None


def _array(tensor: Tensor) -> F32:
    return read_only(tensor.detach().numpy())


def _arrays(fields: Sequence[Tensor | None]) -> RuntimeSplats:
    """The fields of `Splats`, in its order, as the runtime's structure."""
    return RuntimeSplats(*(None if t is None else _array(t) for t in fields))  # type: ignore[arg-type]


def _draw(splats: RuntimeSplats, background: F32, offset: F32, view: View) -> tuple[Drawn, F32]:
    """The values that backward needs, and the image [H, W, 3]."""
    camera = view.camera
    screen = project(splats, camera, view.settings, view.sh_degree, PROFILE, view.threads)
    if len(offset):
        screen.splats[:, CENTRE_X : CENTRE_Y + 1] += offset
    order = sort(screen.depth, screen.radius)
    columns = -(-camera.width // TILE)
    members, starts = tile_lists(screen.tiles, order, screen.counts.sum(axis=0), columns, view.threads)
    colour = np.empty((camera.height, camera.width, 3), np.float32)
    transmittance = np.empty((camera.height, camera.width), np.float32)
    last = np.empty((camera.height, camera.width), np.int32)
    stop = np.float32(STOP[PROFILE])
    composite_tiles(
        screen.splats,
        members,
        starts,
        background,
        stop,
        np.float32(0),
        view.threads,
        colour,
        transmittance,
        last,
    )
    return Drawn(screen, members, starts, transmittance, last), colour


def _draw_backward(
    splats: RuntimeSplats, background: F32, drawn: Drawn, view: View, grad_colour: F32, grad_alpha: F32
) -> tuple[SplatArrays, F32]:
    """The gradients of the splats, and of their centres [N, 2] pixels."""
    tiles = drawn.screen.tiles.astype(np.int64)
    first_row = np.zeros(len(tiles) + 1, np.int64)
    np.cumsum((tiles[:, 2] - tiles[:, 0]) * (tiles[:, 3] - tiles[:, 1]), out=first_row[1:])
    rows = np.empty((len(drawn.members), ROW), np.float32)
    composite_tiles_backward(
        drawn.screen.splats,
        drawn.screen.tiles,
        first_row,
        drawn.members,
        drawn.starts,
        drawn.transmittance,
        drawn.last,
        grad_colour,
        grad_colour @ background - grad_alpha,
        view.threads,
        rows,
    )
    given = SplatArrays(*(getattr(splats, name) for name in SplatArrays._fields))
    rotation = read_only(np.zeros((0, 3, 3))) if splats.sh_rotation is None else splats.sh_rotation
    grad, grad_centre = SplatArrays(*map(np.empty_like, given)), np.empty((len(splats.mean), 2), np.float32)
    project_splats_backward(
        given,
        rotation,
        _view_arrays(view),
        drawn.screen.splats,
        drawn.screen.radius,
        first_row,
        rows,
        view.threads,
        grad,
        grad_centre,
    )
    return grad, grad_centre


def _view_arrays(view: View) -> ViewArrays:
    camera = view.camera
    return ViewArrays(
        read_only(camera.camera_from_world),
        read_only(camera.clip_from_world),
        read_only(camera.centre),
        read_only(np.array((camera.tan_half_fov_x, camera.tan_half_fov_y))),
        camera.width,
        camera.height,
        (view.sh_degree + 1) ** 2,
    )
