"""Stages `blend` and `activate` each alone, from the same parts as the fused kernels; for the conformance kit."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.arrays import BLOCK, U8, Base, Blendable, PosedArrays
from avatar_runtime.backends.cpu.deform.activate import activate_opacity, activate_scale, unit_quats
from avatar_runtime.backends.cpu.deform.blend import blend_geometry, blend_shape, colour_block, list_active
from avatar_runtime.backends.cpu.deform.planes import MEAN, PLANES, QUAT, load, store
from avatar_runtime.backends.cpu.jit import kernel


@kernel()
def blend(
    blendable: Blendable,
    posed: PosedArrays,
    touched: U8,  # [N, 2] all 1
    out: Base,
) -> None:
    """Base + blendshapes of every Gaussian, in training space, into `out`."""
    base, geometry, shape, colour = blendable
    planes = np.empty(PLANES, np.float32)
    entry = np.empty(max(geometry.room, shape.room, colour.room), np.uint32)
    end = np.empty(BLOCK, np.int64)
    for first in range(0, len(base.mean), BLOCK):
        count = min(BLOCK, len(base.mean) - first)
        blend_geometry(first, count, base, geometry, posed, entry, end, planes)
        store(first, count, planes, MEAN, out.mean)
        store(first, count, planes, QUAT, out.quat_wxyz)
        colour_block(first, count, base, colour, posed, entry, end, touched, out.sh)
        every, begin = list_active(first, count, shape, posed, entry, end)
        for lane in range(count):
            i = first + lane
            x, y, z, logit = blend_shape(i, base, shape, posed, entry, every, begin, end[lane])
            out.log_scale[i, 0] = x
            out.log_scale[i, 1] = y
            out.log_scale[i, 2] = z
            out.opacity_logit[i] = logit
            begin = end[lane]


@kernel()
def activate(
    log_scale: F32,  # [N, 3]
    quat_wxyz: F32,  # [N, 4]
    opacity_logit: F32,  # [N]
    scale: F32,  # [N, 3], written
    unit_wxyz: F32,  # [N, 4], written
    opacity: F32,  # [N], written
) -> None:
    """exp of the scale, unit quaternion, sigmoid of the opacity."""
    planes = np.empty(PLANES, np.float32)
    for first in range(0, len(opacity), BLOCK):
        count = min(BLOCK, len(opacity) - first)
        load(first, count, quat_wxyz, QUAT, planes)
        unit_quats(count, planes)
        store(first, count, planes, QUAT, unit_wxyz)
        for i in range(first, first + count):
            activate_scale(i, log_scale[i, 0], log_scale[i, 1], log_scale[i, 2], scale)
            activate_opacity(i, opacity_logit[i], opacity)
