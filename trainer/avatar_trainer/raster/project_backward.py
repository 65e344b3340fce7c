"""Gradients of the `cpu` projection: the rows of each splat's tiles, summed, to mean, scale, quat, opacity and SH.

The chain rule of `avatar_runtime.stages.project`, written out; a clamped value has gradient 0. The
released rasteriser differs in one term: it takes the clamped x of the Jacobian as independent of z.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from avatar_runtime import F32, I32, I64
from avatar_runtime.backends.cpu import inlined, kernel, take_next
from avatar_runtime.backends.cpu.draw import CONIC_XX, CONIC_XY, CONIC_YY, OPACITY
from avatar_trainer.raster.colour_backward import colour_backward
from avatar_trainer.raster.composite_backward import (
    ROW,
    S_BLUE,
    S_GREEN,
    S_RED,
    S_X,
    S_XX,
    S_XY,
    S_Y,
    S_YY,
    S,
)
from avatar_trainer.raster.geometry_backward import (
    HALF,
    TWO,
    add_to,
    centre_backward,
    combined,
    conic_backward,
    covariance,
    covariance_backward,
    factors_backward,
    jacobian,
    jacobian_backward,
    row,
    times,
)

f32 = np.float32
CHUNK = 256  # splats that a worker takes at a time


class SplatArrays(NamedTuple):
    """N splats in world space, as `tensors.Splats` has them without `sh_rotation`; or the gradients of each."""

    mean: F32  # [N, 3]
    scale: F32  # [N, 3]
    quat_wxyz: F32  # [N, 4]
    opacity: F32  # [N]
    sh: F32  # [N, K, 3]


class ViewArrays(NamedTuple):
    """A camera, and the SH coefficients that are seen."""

    camera_from_world: F32  # [4, 4]
    clip_from_world: F32  # [4, 4]
    eye: F32  # [3] world
    lens: F32  # [2] tan_half_fov_x, tan_half_fov_y
    width: int  # pixels
    height: int
    coefficients: int  # of the SH degree


@kernel(parallel=True)
def project_splats_backward(
    splats: SplatArrays,
    sh_rotation: F32,  # [N, 3, 3], or [0, 3, 3]
    view: ViewArrays,
    screen: F32,  # [N, COLUMNS]
    radius: I32,  # [N]
    first_row: I64,  # [N + 1]
    rows: F32,  # [P, ROW] as `composite_tiles_backward` leaves them
    workers: int,
    grad: SplatArrays,  # out, like all arrays that follow
    grad_centre: F32,  # [N, 2] pixels
) -> None:
    """Fill the gradients, zeros where a splat is not drawn. The workers take chunks from one counter."""
    counter = np.zeros(1, np.int64)
    for _ in prange(workers):
        _work(counter, splats, sh_rotation, view, screen, radius, first_row, rows, grad, grad_centre)


@kernel()
def _work(
    counter: I64,
    splats: SplatArrays,
    sh_rotation: F32,
    view: ViewArrays,
    screen: F32,
    radius: I32,
    first_row: I64,
    rows: F32,
    grad: SplatArrays,
    grad_centre: F32,
) -> None:
    total, basis = np.empty(ROW, np.float32), np.empty((16, 4), np.float32)
    while True:
        begin = CHUNK * take_next(counter)
        if begin >= len(splats.mean):
            return
        for i in range(begin, min(begin + CHUNK, len(splats.mean))):
            grad.sh[i] = f32(0)
            grad.mean[i] = f32(0)
            if radius[i] == 0:
                grad.scale[i], grad.quat_wxyz[i] = f32(0), f32(0)
                grad.opacity[i], grad_centre[i] = f32(0), f32(0)
                continue
            _sum_rows(total, rows, first_row[i], first_row[i + 1])
            opacity = screen[i, OPACITY]
            grad.opacity[i] = total[S] / opacity if opacity > f32(0) else f32(0)
            _geometry_backward(i, splats, view, screen, total, grad, grad_centre)
            grad_rgb = total[S_RED], total[S_GREEN], total[S_BLUE]
            colour_backward(
                i,
                grad_rgb,
                splats.mean,
                splats.sh,
                sh_rotation,
                view.eye,
                view.coefficients,
                basis,
                grad.sh,
                grad.mean,
            )


@inlined
def _sum_rows(total: F32, rows: F32, begin: int, end: int) -> None:
    for j in range(ROW):
        total[j] = f32(0)
    for at in range(begin, end):
        for j in range(ROW):
            total[j] += rows[at, j]


@inlined
def _geometry_backward(
    i: int,
    splats: SplatArrays,
    view: ViewArrays,
    screen: F32,
    total: F32,
    grad: SplatArrays,
    grad_centre: F32,
) -> None:
    """From the exponent -(a dx dx + c dy dy) / 2 - b dx dy to centre and conic, and from these to the splat."""
    a, b, c = screen[i, CONIC_XX], screen[i, CONIC_XY], screen[i, CONIC_YY]
    grad_x, grad_y = -(a * total[S_X] + b * total[S_Y]), -(c * total[S_Y] + b * total[S_X])
    grad_centre[i, 0], grad_centre[i, 1] = grad_x, grad_y
    at, size = row(splats.mean, i), row(splats.scale, i)
    q = splats.quat_wxyz
    quat = q[i, 0], q[i, 1], q[i, 2], q[i, 3]
    add_to(grad.mean, i, centre_backward((grad_x, grad_y), at, view.clip_from_world, view.width, view.height))
    grad_cov = conic_backward((-HALF * total[S_XX], -total[S_XY], -HALF * total[S_YY]), a, b, c)
    j = jacobian(at, view.camera_from_world, view.lens, view.width, view.height)
    cov = covariance(size, quat)
    along_x, along_y = times(cov, j.x), times(cov, j.y)
    grad_j_x = combined(TWO * grad_cov[0], along_x, grad_cov[1], along_y)
    grad_j_y = combined(TWO * grad_cov[2], along_y, grad_cov[1], along_x)
    add_to(grad.mean, i, jacobian_backward(j, view.camera_from_world, grad_j_x, grad_j_y))
    factors_backward(i, covariance_backward(grad_cov, j.x, j.y), size, quat, grad.scale, grad.quat_wxyz)
