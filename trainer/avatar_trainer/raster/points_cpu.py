"""Point splatting by Numba kernels, float32: its picture, and its gradients by hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.autograd.function import once_differentiable

from avatar_runtime.avatar import F32, I32, I64, U32
from avatar_runtime.backends.cpu.screen import read_only
from avatar_runtime.backends.cpu.sort import sort
from avatar_runtime.backends.cpu.threads import using
from avatar_runtime.backends.cpu.tiles import tile_lists
from avatar_runtime.camera import Camera
from avatar_trainer.raster.cpu import started
from avatar_trainer.raster.points_kernels import BAND, COLUMNS, ROW, blend_bands, blend_bands_backward, gather
from avatar_trainer.raster.points_screen import Discs


@dataclass(frozen=True)
class Lists:
    """Which discs each band of BAND pixel rows blends, front to back."""

    members: U32  # [P] discs, band by band
    starts: I64  # [bands + 1]
    first_band: I32  # [M] of each disc
    first_pair: I64  # [M + 1] where a disc's rows begin, one for each of its bands


def blend(
    discs: Discs, camera: Camera, background: Tensor, threads: int | None
) -> tuple[Tensor, Tensor, Tensor]:
    """As the definition's `blend`; the same bits whatever the number of threads."""
    workers = started(threads)
    lists = _lists(discs, camera.height, workers)
    colour, transmittance, largest = _Blend.apply(  # type: ignore[no-untyped-call]
        discs.centre, discs.radius, discs.opacity, discs.rgb, background, lists, (camera, workers)
    )
    return colour, transmittance, largest


def _lists(discs: Discs, height: int, workers: int) -> Lists:
    """Every disc in the bands that its box of pixels meets."""
    bands = -(-height // BAND)
    y, radius = (value.detach().numpy().astype(np.float64) for value in (discs.centre[:, 1], discs.radius))
    tiles = np.zeros((len(y), 4), np.int32)
    tiles[:, 2] = 1
    tiles[:, 1] = np.clip(np.floor((y - radius) / BAND), 0, bands - 1)
    tiles[:, 3] = np.clip(np.floor((y + radius) / BAND), 0, bands - 1) + 1
    ends = (np.bincount(tiles[:, column], minlength=bands + 1) for column in (1, 3))
    counts = np.cumsum(np.subtract(*ends))[:bands].astype(np.int64)
    order = sort(discs.depth.numpy(), np.ones(len(y), np.int32))
    members, starts = tile_lists(tiles, order, counts, 1, workers)
    first_pair = np.zeros(len(y) + 1, np.int64)
    np.cumsum(tiles[:, 3] - tiles[:, 1], out=first_pair[1:])
    return Lists(members, starts, np.ascontiguousarray(tiles[:, 1]), first_pair)


class _Blend(torch.autograd.Function):
    """Discs to colour and transmittance."""

    @staticmethod
    def forward(
        ctx: Any,
        centre: Tensor,
        radius: Tensor,
        opacity: Tensor,
        rgb: Tensor,
        background: Tensor,
        lists: Lists,
        view: tuple[Camera, int],
    ) -> tuple[Tensor, Tensor, Tensor]:
        camera, workers = view
        discs, shape = _rows(centre, radius, opacity, rgb), (camera.height, camera.width)
        colour, transmittance = np.empty((*shape, 3), np.float32), np.empty(shape, np.float32)
        last = np.empty(shape, np.int32)
        weight = np.empty((len(lists.members), 1), np.float32)
        with using(workers):
            blend_bands(
                discs,
                lists.members,
                lists.starts,
                lists.first_band,
                lists.first_pair,
                read_only(background.detach().numpy()),
                workers,
                colour,
                transmittance,
                last,
                weight,
            )
        largest = np.empty((len(discs), 1), np.float32)
        gather(weight, lists.first_pair, True, largest)
        ctx.discs, ctx.lists, ctx.workers, ctx.drawn = discs, lists, workers, (transmittance, last)
        ctx.save_for_backward(background)
        result = torch.from_numpy(largest[:, 0])
        ctx.mark_non_differentiable(result)
        return torch.from_numpy(colour), torch.from_numpy(transmittance.copy()), result

    @staticmethod
    @once_differentiable
    def backward(
        ctx: Any, of_colour: Tensor, of_transmittance: Tensor, _: Tensor
    ) -> tuple[Tensor | None, ...]:
        (background,), (transmittance, last) = ctx.saved_tensors, ctx.drawn
        lists: Lists = ctx.lists
        rows = np.empty((len(lists.members), ROW), np.float32)
        behind = of_colour.numpy() @ background.detach().numpy() + of_transmittance.numpy()
        with using(ctx.workers):
            blend_bands_backward(
                ctx.discs,
                lists.members,
                lists.starts,
                lists.first_band,
                lists.first_pair,
                transmittance,
                last,
                read_only(of_colour.numpy()),
                read_only(behind),
                ctx.workers,
                rows,
            )
        of = np.empty((len(ctx.discs), ROW), np.float32)
        gather(rows, lists.first_pair, False, of)
        of_disc = torch.from_numpy(of)
        left = torch.from_numpy(transmittance)
        of_background = (left[..., None].double() * of_colour).sum(dim=(0, 1)).float()
        return of_disc[:, :2], of_disc[:, 2], of_disc[:, 3], of_disc[:, 4:], of_background, None, None


def _rows(centre: Tensor, radius: Tensor, opacity: Tensor, rgb: Tensor) -> F32:
    """[M, COLUMNS] as the kernels take discs."""
    rows: F32 = torch.cat([centre, radius[:, None], opacity[:, None], rgb], dim=1).detach().numpy()
    assert rows.shape[1] == COLUMNS
    return read_only(rows)
