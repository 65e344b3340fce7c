"""The passes over embedded Gaussians, after `surface` has prepared the triangles and vertices of the posed mesh."""

from __future__ import annotations

import math

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.arrays import (
    BLOCK,
    Base,
    Deltas,
    Embedded,
    EmbeddedRules,
    Mesh,
    Out,
    PosedArrays,
    PosedMesh,
)
from avatar_runtime.backends.cpu.deform.activate import activate_opacity, activate_scale, unit_quats
from avatar_runtime.backends.cpu.deform.bind import place
from avatar_runtime.backends.cpu.deform.blend import blend_shape, colour_block, list_active
from avatar_runtime.backends.cpu.deform.planes import MEAN, PLANES, QUAT, TURN, store
from avatar_runtime.backends.cpu.deform.surface import GAUSSIAN_PLANES, bind_embedded_block
from avatar_runtime.backends.cpu.jit import Scalar, inlined, kernel
from avatar_runtime.rules import code
from avatar_runtime.stages.surface import TINY

SAME, LOG_AREA = code("scale", "none"), code("scale", "log_area")
LINEAR = code("scale", "linear_area")  # and triangle_linear


@kernel()
def animate_embedded(
    thread: int,
    threads: int,
    base: Base,
    shape: Deltas,
    colour: Deltas,
    embedded: Embedded,
    mesh: Mesh,
    rules: EmbeddedRules,
    posed_mesh: PosedMesh,
    vertices: F32,  # [V, 3] posed
    posed: PosedArrays,
    out: Out,
) -> None:
    """Writes every `threads`-th block of splats from block `thread`; the same bits for any number of threads.

    Only the mesh moves embedded Gaussians, so no deltas of mean and quaternion are needed.
    """
    n = len(base.mean)
    planes = np.empty(PLANES, np.float32)
    fine = np.empty(GAUSSIAN_PLANES, np.float64)
    entry = np.empty(max(shape.room, colour.room), np.uint32)
    end = np.empty(BLOCK, np.int64)
    for first in range(thread * BLOCK, n, threads * BLOCK):
        count = min(BLOCK, n - first)
        bind_embedded_block(first, count, embedded, rules.position, vertices, posed_mesh, fine, planes)
        place(count, rules.sh_world, posed.world, posed.world_quat, planes)
        unit_quats(count, planes)
        store(first, count, planes, MEAN, out.mean)
        store(first, count, planes, QUAT, out.quat_wxyz)
        store(first, count, planes, TURN, out.sh_rotation)
        colour_block(first, count, base, colour, posed, entry, end, out.touched, out.sh)
        every, begin = list_active(first, count, shape, posed, entry, end)
        for lane in range(count):
            i, last = first + lane, end[lane]
            changed = last > begin or out.touched[i, 0]
            if changed or rules.scale != SAME:
                x, y, z, logit = blend_shape(i, base, shape, posed, entry, every, begin, last)
                factor = stretch(embedded.triangle[i], mesh, rules, posed_mesh)
                x = stretched(x, factor, rules)
                y = stretched(y, factor, rules)
                z = stretched(z, factor, rules)
                activate_scale(i, x, y, z, out.scale)
                if changed:
                    activate_opacity(i, logit, out.opacity)
                    out.touched[i, 0] = last > begin
            begin = last


@kernel()
def bind_embedded(
    log_scale: F32,  # [N, 3] blended
    embedded: Embedded,
    mesh: Mesh,
    rules: EmbeddedRules,
    posed_mesh: PosedMesh,
    vertices: F32,  # [V, 3] posed
    posed: PosedArrays,
    out: Out,
) -> None:
    """Stage `bind` alone: mean, log scale (in `scale`), quat_wxyz (any length) and sh_rotation of `out`."""
    planes = np.empty(PLANES, np.float32)
    fine = np.empty(GAUSSIAN_PLANES, np.float64)
    for first in range(0, len(log_scale), BLOCK):
        count = min(BLOCK, len(log_scale) - first)
        bind_embedded_block(first, count, embedded, rules.position, vertices, posed_mesh, fine, planes)
        place(count, rules.sh_world, posed.world, posed.world_quat, planes)
        store(first, count, planes, MEAN, out.mean)
        store(first, count, planes, QUAT, out.quat_wxyz)
        store(first, count, planes, TURN, out.sh_rotation)
        for i in range(first, first + count):
            factor = stretch(embedded.triangle[i], mesh, rules, posed_mesh)
            for k in range(3):
                out.scale[i, k] = stretched(log_scale[i, k], factor, rules)


@inlined
def stretch(triangle: int, mesh: Mesh, rules: EmbeddedRules, posed_mesh: PosedMesh) -> Scalar:
    """How much a triangle has grown since the binding pose, as the scale rule takes it."""
    if rules.scale == LOG_AREA:
        return (posed_mesh.size[triangle] + rules.damping) / (mesh.size[triangle] + rules.damping)
    if rules.scale == LINEAR:
        return math.log(max(posed_mesh.size[triangle], TINY) / mesh.size[triangle])
    return 0.0


@inlined
def stretched(log_scale: Scalar, factor: Scalar, rules: EmbeddedRules) -> Scalar:
    """A blended log scale after the scale rule, float32."""
    if rules.scale == LOG_AREA:
        return np.float32((log_scale + rules.log_unit) * factor - rules.log_unit)
    if rules.scale == LINEAR:
        return np.float32(log_scale + factor)
    return log_scale
