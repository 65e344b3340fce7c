"""Stage `blend` of one Gaussian: base + sum_k w_k delta_k in training space, its sparse rows read as stored."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.jit import inlined
from avatar_runtime.backends.cpu.plain import Appearance, Base, Geometry, Offsets, PosedArrays

ZERO = np.float32(0)


@inlined
def blend_geometry(i: int, base: Base, geometry: Geometry, posed: PosedArrays) -> tuple[float, ...]:
    """Position (3) and raw quaternion (4) of Gaussian `i`."""
    x = y = z = qw = qx = qy = qz = ZERO
    if geometry.mask[i] & posed.expression_mask[0]:
        for e in range(geometry.row_ptr[i], geometry.row_ptr[i + 1]):
            w = posed.expression_weights[geometry.column[e]]
            if w != ZERO:
                x += geometry.mean[e, 0] * w
                y += geometry.mean[e, 1] * w
                z += geometry.mean[e, 2] * w
                qw += geometry.quat_wxyz[e, 0] * w
                qx += geometry.quat_wxyz[e, 1] * w
                qy += geometry.quat_wxyz[e, 2] * w
                qz += geometry.quat_wxyz[e, 3] * w
    mean, quat = base.mean, base.quat_wxyz
    return (
        mean[i, 0] + x,
        mean[i, 1] + y,
        mean[i, 2] + z,
        quat[i, 0] + qw,
        quat[i, 1] + qx,
        quat[i, 2] + qy,
        quat[i, 3] + qz,
    )


@inlined
def blend_shape(i: int, base: Base, appearance: Appearance, posed: PosedArrays) -> tuple[float, ...]:
    """Log scale (3) and opacity logit of Gaussian `i`."""
    x = y = z = logit = ZERO
    if appearance.mask[i] & posed.expression_mask[0]:
        for e in range(appearance.row_ptr[i], appearance.row_ptr[i + 1]):
            w = posed.expression_weights[appearance.column[e]]
            if w != ZERO:
                x += appearance.log_scale[e, 0] * w
                y += appearance.log_scale[e, 1] * w
                z += appearance.log_scale[e, 2] * w
                logit += appearance.opacity_logit[e] * w
    scale = base.log_scale
    return scale[i, 0] + x, scale[i, 1] + y, scale[i, 2] + z, base.opacity_logit[i] + logit


@inlined
def blend_sh(i: int, base: Base, appearance: Appearance, posed: PosedArrays, out: F32) -> None:
    """SH of Gaussian `i`, into row `i` of `out` [N, 3 K]."""
    width = out.shape[1]
    if not appearance.mask[i] & posed.expression_mask[0]:
        for k in range(width):
            out[i, k] = base.sh[i, k]
        return
    for k in range(width):
        out[i, k] = ZERO
    for e in range(appearance.row_ptr[i], appearance.row_ptr[i + 1]):
        w = posed.expression_weights[appearance.column[e]]
        if w != ZERO:
            for k in range(width):
                out[i, k] += appearance.sh[e, k] * w
    for k in range(width):
        out[i, k] = base.sh[i, k] + out[i, k]


@inlined
def offset_of(i: int, offsets: Offsets, weights: F32) -> tuple[float, float, float]:
    """Sum over row `i` of weight * offset."""
    x = y = z = ZERO
    for e in range(offsets.row_ptr[i], offsets.row_ptr[i + 1]):
        w = weights[offsets.column[e]]
        if w != ZERO:
            x += offsets.offset[e, 0] * w
            y += offsets.offset[e, 1] * w
            z += offsets.offset[e, 2] * w
    return x, y, z
