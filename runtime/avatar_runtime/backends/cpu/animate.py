"""Stages `blend`, `bind` and `activate` in one pass over the Gaussians, in one parallel region."""

from __future__ import annotations

import math

import numba
import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.activate import sigmoid, unit_quats
from avatar_runtime.backends.cpu.bind import MEAN, PLANES, QUAT, TURN, bind_block
from avatar_runtime.backends.cpu.blend import blend_geometry, blend_sh, blend_shape
from avatar_runtime.backends.cpu.jit import inlined, kernel
from avatar_runtime.backends.cpu.plain import (
    BLOCK,
    U8,
    Appearance,
    Base,
    Blocks,
    Geometry,
    Influences,
    Offsets,
    Out,
    PosedArrays,
)


@kernel(parallel=True)
def animate_skinned(
    base: Base,
    geometry: Geometry,
    appearance: Appearance,
    correctives: Offsets,
    late_morphs: Offsets,
    skin: Influences,
    blocks: Blocks,
    sh_world: bool,
    posed: PosedArrays,
    touched: U8,  # [N] 0 where scale, opacity and SH in `out` are already those of no expression
    out: Out,
    threads: int,
) -> None:
    """Writes the splats of one frame into `out`; the same bits whatever the number of threads."""
    for thread in numba.prange(threads):
        planes = np.empty(PLANES, np.float32)
        for block in range(thread, len(blocks.first), threads):
            first, count = blocks.first[block], blocks.count[block]
            blend_block(first, count, base, geometry, posed, planes)
            bind_block(block, blocks, correctives, late_morphs, skin, sh_world, posed, planes)
            unit_quats(count, planes)
            store(first, count, planes, out.mean, out.quat_wxyz, out.sh_rotation)
            for i in range(first, first + count):
                show(i, base, appearance, posed, touched, out)


@inlined
def blend_block(first: int, count: int, base: Base, geometry: Geometry, posed: PosedArrays, planes: F32) -> None:
    """MEAN and QUAT of the Gaussians first .. first + count."""
    for lane in range(count):
        values = blend_geometry(first + lane, base, geometry, posed)
        for k in range(7):  # QUAT follows MEAN
            planes[MEAN + k * BLOCK + lane] = values[k]


@inlined
def store(first: int, count: int, planes: F32, mean: F32, quat_wxyz: F32, sh_rotation: F32) -> None:
    """From planes to rows."""
    for lane in range(count):
        for k in range(3):
            mean[first + lane, k] = planes[MEAN + k * BLOCK + lane]
        for k in range(4):
            quat_wxyz[first + lane, k] = planes[QUAT + k * BLOCK + lane]
        for k in range(9):
            sh_rotation[first + lane, k] = planes[TURN + k * BLOCK + lane]


@inlined
def show(i: int, base: Base, appearance: Appearance, posed: PosedArrays, touched: U8, out: Out) -> None:
    """Scale, opacity and SH of Gaussian `i`, where an expression moves them or did at the last frame."""
    hit = (appearance.mask[i] & posed.expression_mask[0]) != 0
    if hit or touched[i]:
        x, y, z, logit = blend_shape(i, base, appearance, posed)
        out.scale[i, 0] = math.exp(x)
        out.scale[i, 1] = math.exp(y)
        out.scale[i, 2] = math.exp(z)
        out.opacity[i] = sigmoid(logit)
        blend_sh(i, base, appearance, posed, out.sh)
        touched[i] = hit
