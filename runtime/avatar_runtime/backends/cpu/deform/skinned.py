"""Stages `blend`, `bind` and `activate` in one pass over the Gaussians."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32, U32
from avatar_runtime.backends.cpu.arrays import (
    BLOCK,
    Base,
    Blocks,
    Deltas,
    Influences,
    Offsets,
    Out,
    PosedArrays,
)
from avatar_runtime.backends.cpu.deform.activate import activate_planes, unit_quats
from avatar_runtime.backends.cpu.deform.bind import bind_block
from avatar_runtime.backends.cpu.deform.blend import (
    Ends,
    blend_geometry,
    blend_shape,
    colour_block,
    list_active,
)
from avatar_runtime.backends.cpu.deform.planes import MEAN, PLANES, QUAT, SHAPE, TURN, load, store
from avatar_runtime.backends.cpu.jit import inlined, kernel


@kernel()
def animate_skinned(
    thread: int,
    threads: int,
    base: Base,
    geometry: Deltas,
    shape: Deltas,
    colour: Deltas,
    correctives: Offsets,
    late_morphs: Offsets,
    skin: Influences,
    blocks: Blocks,
    posed: PosedArrays,
    out: Out,
) -> None:
    """Writes every `threads`-th block of splats from block `thread`; the same bits for any number of threads."""
    planes = np.empty(PLANES, np.float32)
    entry = np.empty(max(geometry.room, shape.room, colour.room), np.uint32)
    end = np.empty(BLOCK, np.int64)
    for block in range(thread, len(blocks.begin), threads):
        first, count = blocks.begin[block], blocks.size[block]
        blend_geometry(first, count, base, geometry, posed, entry, end, planes)
        bind_block(block, blocks, correctives, late_morphs, skin, posed, planes)
        unit_quats(count, planes)
        store(first, count, planes, MEAN, out.mean)
        store(first, count, planes, QUAT, out.quat_wxyz)
        store(first, count, planes, TURN, out.sh_rotation)
        activate_shapes(first, count, base, shape, posed, entry, end, planes, out)
        colour_block(first, count, base, colour, posed, entry, end, out.touched, out.sh)


@kernel()
def bind_skinned(
    mean: F32,  # [N, 3] blended
    quat_wxyz: F32,  # [N, 4] blended
    correctives: Offsets,
    late_morphs: Offsets,
    skin: Influences,
    blocks: Blocks,
    posed: PosedArrays,
    out: Out,
) -> None:
    """Stage `bind` alone: mean, quat_wxyz (any length) and sh_rotation of `out`."""
    planes = np.empty(PLANES, np.float32)
    for block in range(len(blocks.begin)):
        first, count = blocks.begin[block], blocks.size[block]
        load(first, count, mean, MEAN, planes)
        load(first, count, quat_wxyz, QUAT, planes)
        bind_block(block, blocks, correctives, late_morphs, skin, posed, planes)
        store(first, count, planes, MEAN, out.mean)
        store(first, count, planes, QUAT, out.quat_wxyz)
        store(first, count, planes, TURN, out.sh_rotation)


@inlined
def activate_shapes(
    first: int,
    count: int,
    base: Base,
    shape: Deltas,
    posed: PosedArrays,
    entry: U32,
    end: Ends,
    planes: F32,
    out: Out,
) -> None:
    """Scale and opacity of `count` Gaussians, where an expression moves them or did in the previous frame."""
    every, begin = list_active(first, count, shape, posed, entry, end)
    start, changed = begin, False
    for lane in range(count):
        i, last = first + lane, end[lane]
        if last > begin or out.touched[i, 0]:
            x, y, z, logit = blend_shape(i, base, shape, posed, entry, every, begin, last)
            planes[SHAPE + lane] = x
            planes[SHAPE + BLOCK + lane] = y
            planes[SHAPE + 2 * BLOCK + lane] = z
            planes[SHAPE + 3 * BLOCK + lane] = logit
            changed = True
        begin = last
    if not changed:
        return
    activate_planes(planes)
    begin = start
    for lane in range(count):
        i, last = first + lane, end[lane]
        if last > begin or out.touched[i, 0]:
            for k in range(3):
                out.scale[i, k] = planes[SHAPE + k * BLOCK + lane]
            out.opacity[i] = planes[SHAPE + 3 * BLOCK + lane]
            out.touched[i, 0] = last > begin
        begin = last
