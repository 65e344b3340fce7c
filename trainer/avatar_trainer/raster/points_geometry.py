"""The kernels that project points to the screen, and their backward pass; twin of `points_screen.project`, float32."""

from __future__ import annotations

import math

import numpy as np

from avatar_runtime import F32, I32, I64
from avatar_runtime.backends.cpu import inlined, kernel
from avatar_runtime.backends.cpu.draw import HOMOGENEOUS_EPSILON
from avatar_trainer.raster import points_screen
from avatar_trainer.raster.points_kernels import (
    BAND,
    BLUE,
    CENTRE_X,
    CENTRE_Y,
    GREEN,
    OPACITY,
    RADIUS,
    RED,
    ROW,
    S_BLUE,
    S_FALL,
    S_GREEN,
    S_RED,
    S_SQUARE,
    S_X,
    S_Y,
)

f32, f64 = np.float32, np.float64
LEAST_RADIUS = f32(points_screen.LEAST_RADIUS)


@kernel()
def project_points(
    mean: F32,  # [N, 3]
    radius: F32,  # [N] metres
    opacity: F32,  # [N]
    rgb: F32,  # [N, 3]
    offset: F32,  # [N, 2] pixels, or [0, 2]
    view: F32,  # [4, 4] camera_from_world
    clip: F32,  # [4, 4] clip_from_world
    lens: F32,  # [2] focal_x pixels, near
    width: int,
    height: int,
    discs: F32,  # [N, COLUMNS] out, like all that follow; zeros where a point is not drawn
    depth: F32,  # [N]
    reach: I32,  # [N] radius on the screen, rounded up
    bands: I32,  # [N, 4] 0, first band, 1, end; comes as zeros
    counts: I64,  # [bands] how many discs meet each; comes as zeros
) -> None:
    """Fill the arrays."""
    for i in range(len(mean)):
        z = _row(view, 2, mean, i)
        x, y = _centre(clip, mean, i, width, height)
        if len(offset):
            x, y = x + offset[i, 0], y + offset[i, 1]
        wide = max(lens[0] * radius[i] / z, LEAST_RADIUS)
        meets = (x + wide > f32(0)) & (y + wide > f32(0))
        meets &= (x - wide < f32(width - 1)) & (y - wide < f32(height - 1))
        depth[i], reach[i], discs[i] = f32(0), 0, f32(0)
        if meets and z > lens[1] and wide < f32(np.inf):
            discs[i, CENTRE_X], discs[i, CENTRE_Y], discs[i, RADIUS], discs[i, OPACITY] = (
                x,
                y,
                wide,
                opacity[i],
            )
            discs[i, RED], discs[i, GREEN], discs[i, BLUE] = rgb[i, 0], rgb[i, 1], rgb[i, 2]
            depth[i], reach[i] = z, np.int32(math.ceil(min(wide, f32(2**30))))
            bands[i, 1] = np.int32(max(y - wide, f32(0)) / f32(BAND))
            bands[i, 2] = 1
            bands[i, 3] = np.int32(min(y + wide, f32(height - 1)) / f32(BAND)) + 1
            for band in range(bands[i, 1], bands[i, 3]):
                counts[band] += 1


@inlined
def _row(m: F32, k: int, mean: F32, i: int) -> np.float32:
    result: np.float32 = m[k, 0] * mean[i, 0] + m[k, 1] * mean[i, 1] + m[k, 2] * mean[i, 2] + m[k, 3]
    return result


@inlined
def _centre(clip: F32, mean: F32, i: int, width: int, height: int) -> tuple[np.float32, np.float32]:
    """Pixels; as stage `project`, in double from the float32 position in the clip volume."""
    reciprocal = f32(1) / (_row(clip, 3, mean, i) + HOMOGENEOUS_EPSILON)
    x, y = f64(_row(clip, 0, mean, i) * reciprocal), f64(_row(clip, 1, mean, i) * reciprocal)
    return f32(((x + 1.0) * f64(width) - 1.0) * 0.5), f32(((y + 1.0) * f64(height) - 1.0) * 0.5)


@kernel()
def project_points_backward(
    mean: F32,
    radius: F32,
    view: F32,
    clip: F32,
    lens: F32,
    width: int,
    height: int,
    discs: F32,
    first_row: I64,  # [N + 1]
    rows: F32,  # [P, ROW] as `composite_bands_backward` leaves them
    grad_mean: F32,  # [N, 3] out, like all that follow
    grad_radius: F32,  # [N]
    grad_opacity: F32,  # [N]
    grad_rgb: F32,  # [N, 3]
    grad_centre: F32,  # [N, 2] pixels
) -> None:
    """The gradients of the points, each the sum of its rows in order; 0 where it is not drawn."""
    total = np.empty(ROW, np.float32)
    for i in range(len(mean)):
        grad_mean[i], grad_radius[i], grad_opacity[i] = f32(0), f32(0), f32(0)
        grad_rgb[i], grad_centre[i] = f32(0), f32(0)
        if first_row[i + 1] == first_row[i]:
            continue
        total[:] = f32(0)
        for k in range(first_row[i], first_row[i + 1]):
            for j in range(ROW):
                total[j] += rows[k, j]
        wide = discs[i, RADIUS]
        steep = f32(2) * discs[i, OPACITY] / (wide * wide)
        grad_x, grad_y, grad_wide = -steep * total[S_X], -steep * total[S_Y], steep * total[S_SQUARE] / wide
        grad_opacity[i], grad_centre[i, 0], grad_centre[i, 1] = total[S_FALL], grad_x, grad_y
        grad_rgb[i, 0], grad_rgb[i, 1], grad_rgb[i, 2] = total[S_RED], total[S_GREEN], total[S_BLUE]
        per_depth = lens[0] / _row(view, 2, mean, i)
        grad_z = f32(0)
        if per_depth * radius[i] > LEAST_RADIUS:
            grad_radius[i] = grad_wide * per_depth
            grad_z = -grad_wide * wide * per_depth / lens[0]
        reciprocal = f32(1) / (_row(clip, 3, mean, i) + HOMOGENEOUS_EPSILON)
        grad_x, grad_y = f32(0.5 * width) * reciprocal * grad_x, f32(0.5 * height) * reciprocal * grad_y
        grad_w = -reciprocal * (grad_x * _row(clip, 0, mean, i) + grad_y * _row(clip, 1, mean, i))
        for k in range(3):
            grad_mean[i, k] = (
                grad_x * clip[0, k] + grad_y * clip[1, k] + grad_w * clip[3, k] + grad_z * view[2, k]
            )
