"""The passes over Gaussians that ride on a mesh, after `surface` has prepared its triangles and vertices."""

from __future__ import annotations

import math

import numba
import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.arrays import (
    BLOCK,
    U8,
    Base,
    Deltas,
    Embedded,
    Mesh,
    Out,
    PosedArrays,
    Ridden,
)
from avatar_runtime.backends.cpu.deform.activate import activate_opacity, activate_scale, unit_quats
from avatar_runtime.backends.cpu.deform.bind import place
from avatar_runtime.backends.cpu.deform.blend import blend_shape, colour_block, list_active
from avatar_runtime.backends.cpu.deform.planes import MEAN, PLANES, QUAT, TURN, store
from avatar_runtime.backends.cpu.deform.surface import GAUSSIAN_PLANES, ride_block
from avatar_runtime.backends.cpu.jit import Scalar, inlined, kernel
from avatar_runtime.rules import code
from avatar_runtime.stages.surface import TINY

SAME, LOG_AREA = code("scale", "none"), code("scale", "log_area")
LINEAR = code("scale", "linear_area")  # and triangle_linear


@kernel(parallel=True)
def animate_riding(
    base: Base,
    geometry: Deltas,  # not read: the mesh alone moves them
    shape: Deltas,
    colour: Deltas,
    room: int,
    embedded: Embedded,
    mesh: Mesh,
    ridden: Ridden,
    vertices: F32,  # [V, 3] posed
    position_rule: int,
    scale_rule: int,
    log_unit: float,  # ln of training_per_bundle
    damping: float,
    sh_world: bool,
    posed: PosedArrays,
    touched: U8,  # [N, 2] as in animate_skinned
    out: Out,
    threads: int,
) -> None:
    """Writes the splats of a frame into `out`; the same bits whatever the number of threads."""
    for thread in numba.prange(threads):
        # A call, since Numba drops a loop whose own stores go to the arrays of a tuple.
        animate_share(
            thread,
            threads,
            base,
            shape,
            colour,
            room,
            embedded,
            mesh,
            ridden,
            vertices,
            position_rule,
            scale_rule,
            log_unit,
            damping,
            sh_world,
            posed,
            touched,
            out,
        )


@inlined
def animate_share(
    thread: int,
    threads: int,
    base: Base,
    shape: Deltas,
    colour: Deltas,
    room: int,
    embedded: Embedded,
    mesh: Mesh,
    ridden: Ridden,
    vertices: F32,
    position_rule: int,
    scale_rule: int,
    log_unit: float,
    damping: float,
    sh_world: bool,
    posed: PosedArrays,
    touched: U8,
    out: Out,
) -> None:
    """Every `threads`-th block from block `thread`."""
    n = len(base.mean)
    planes = np.empty(PLANES, np.float32)
    fine = np.empty(GAUSSIAN_PLANES, np.float64)
    entry = np.empty(room, np.uint32)
    end = np.empty(BLOCK, np.int64)
    for first in range(thread * BLOCK, n, threads * BLOCK):
        count = min(BLOCK, n - first)
        ride_block(first, count, embedded, vertices, position_rule, ridden, fine, planes)
        place(count, sh_world, posed.world, posed.world_quat, planes)
        unit_quats(count, planes)
        store(first, count, planes, MEAN, out.mean)
        store(first, count, planes, QUAT, out.quat_wxyz)
        store(first, count, planes, TURN, out.sh_rotation)
        colour_block(first, count, base, colour, posed, entry, end, touched, out.sh)
        every, begin = list_active(first, count, shape, posed, entry, end)
        for lane in range(count):
            i, last = first + lane, end[lane]
            changed = last > begin or touched[i, 0]
            if changed or scale_rule != SAME:
                x, y, z, logit = blend_shape(i, base, shape, posed, entry, every, begin, last)
                factor = stretch(embedded.triangle[i], mesh, ridden, scale_rule, damping)
                x = stretched(x, factor, scale_rule, log_unit)
                y = stretched(y, factor, scale_rule, log_unit)
                z = stretched(z, factor, scale_rule, log_unit)
                activate_scale(i, x, y, z, out.scale)
                if changed:
                    activate_opacity(i, logit, out.opacity)
                    touched[i, 0] = last > begin
            begin = last


@kernel()
def bind_riding(
    log_scale: F32,  # [N, 3] blended
    embedded: Embedded,
    mesh: Mesh,
    ridden: Ridden,
    vertices: F32,  # [V, 3] posed
    position_rule: int,
    scale_rule: int,
    log_unit: float,
    damping: float,
    sh_world: bool,
    posed: PosedArrays,
    out: Out,
) -> None:
    """Stage `bind` alone: mean, log scale (in `scale`), quat_wxyz (any length) and sh_rotation of `out`."""
    planes = np.empty(PLANES, np.float32)
    fine = np.empty(GAUSSIAN_PLANES, np.float64)
    for first in range(0, len(log_scale), BLOCK):
        count = min(BLOCK, len(log_scale) - first)
        ride_block(first, count, embedded, vertices, position_rule, ridden, fine, planes)
        place(count, sh_world, posed.world, posed.world_quat, planes)
        store(first, count, planes, MEAN, out.mean)
        store(first, count, planes, QUAT, out.quat_wxyz)
        store(first, count, planes, TURN, out.sh_rotation)
        for i in range(first, first + count):
            factor = stretch(embedded.triangle[i], mesh, ridden, scale_rule, damping)
            for k in range(3):
                out.scale[i, k] = stretched(log_scale[i, k], factor, scale_rule, log_unit)


@inlined
def stretch(triangle: int, mesh: Mesh, ridden: Ridden, scale_rule: int, damping: float) -> Scalar:
    """How its triangle has grown since the binding pose, as the scale rule takes it."""
    if scale_rule == LOG_AREA:
        return (ridden.size[triangle] + damping) / (mesh.size[triangle] + damping)
    if scale_rule == LINEAR:
        return math.log(max(ridden.size[triangle], TINY) / mesh.size[triangle])
    return 0.0


@inlined
def stretched(log_scale: Scalar, factor: Scalar, scale_rule: int, log_unit: float) -> Scalar:
    """A blended log scale after the scale rule, float32."""
    if scale_rule == LOG_AREA:
        return np.float32((log_scale + log_unit) * factor - log_unit)
    if scale_rule == LINEAR:
        return np.float32(log_scale + factor)
    return log_scale
