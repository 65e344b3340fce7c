"""Stage `raster` of the `cpu` backend: 16x16 tiles, 16 lanes at a time, both profiles.

A tile is 4x4 blocks of 4x4 pixels. One vector of 16 lanes asks which of the tile's blocks a splat can reach,
and one vector of 16 lanes composites it onto a block. The exponent is computed in the definition's order of
operations; a block is left out only if every alpha is certainly below 1/255 (see `screen.reach_of`).
"""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32, I32, I64, U32
from avatar_runtime.backends.cpu.draw.screen import (
    BLUE,
    CENTRE_X,
    CENTRE_Y,
    COLUMNS,
    CONIC_XX,
    CONIC_XY,
    CONIC_YY,
    GREEN,
    OPACITY,
    REACH,
    RED,
    TILE,
    U_OF_V,
    V_OF_U,
)
from avatar_runtime.backends.cpu.jit import called, inlined, kernel
from avatar_runtime.backends.cpu.lanes import exponential, fma, lanes_above, lowest_bit, prefetch, take_next
from avatar_runtime.backends.cpu.workers import share
from avatar_schema import constants

f32, u32, u64 = np.float32, np.uint32, np.uint64
ALPHA_MAX = f32(constants()["alpha_max"])
ALPHA_MIN = f32(1) / f32(constants()["alpha_min_denominator"])
BATCH = 32  # splats looked up at once, between two looks at which blocks are still open
LANES = 16  # pixels of a block, and blocks of a tile
ALL_BLOCKS = u32(0xFFFF)
# Where a block's state keeps, after 16 transmittances, 16 of each colour and 16 last positions.
RED_LANES, GREEN_LANES, BLUE_LANES, LAST_LANES = LANES, 2 * LANES, 3 * LANES, 4 * LANES
BLOCK = 5 * LANES
CACHE_LINE = 64  # bytes; a vector that lies across two lines costs twice


def composite_tiles(
    splats: F32,  # [N, COLUMNS] as `screen.py` says
    members: U32,  # [P] ids, tile by tile, front to back
    starts: I64,  # [tiles + 1]
    background: F32,  # [3]
    stop: np.float32,  # a splat that would leave less transmittance ends the pixel; 0: none does
    closed: np.float32,  # a block stops when none of its pixels has more transmittance than this
    workers: int,
    colour: F32,  # [H, W, 3] out
    transmittance: F32,  # [H, W] out
    last: I32,  # [H, W] out
) -> int:
    """Composite every tile; returns the number of exponents computed. The workers take tiles from one counter."""
    counter, evaluations = np.zeros(1, np.int64), np.zeros(workers, np.int64)
    share(
        composite_share,
        workers,
        counter,
        evaluations,
        splats,
        members,
        starts,
        background,
        stop,
        closed,
        colour,
        transmittance,
        last,
    )
    return int(evaluations.sum())


@kernel()
def composite_share(
    worker: int,
    counter: I64,
    evaluations: I64,
    splats: F32,
    members: U32,
    starts: I64,
    background: F32,
    stop: np.float32,
    closed: np.float32,
    colour: F32,
    transmittance: F32,
    last: I32,
) -> None:
    """Composite tiles until none is left; the exponents computed go into evaluations[worker]."""
    columns = -(-transmittance.shape[1] // TILE)
    state = aligned(LANES * BLOCK)
    batch = aligned(BATCH * COLUMNS).reshape(BATCH, COLUMNS)
    masks, least = np.empty(BATCH, np.uint32), aligned(LANES)
    positions = state.view(np.int32)
    blocks = 0
    while True:
        tile = take_next(counter)
        if tile >= len(starts) - 1:
            evaluations[worker] = blocks * LANES
            return
        x0, y0 = TILE * (tile % columns), TILE * (tile // columns)
        mine = members[starts[tile] : starts[tile + 1]]
        blocks += _composite(
            state, positions, batch, masks, least, splats, mine, f32(x0), f32(y0), stop, closed
        )
        _write(state, positions, x0, y0, background, colour, transmittance, last)


@inlined
def aligned(count: int) -> F32:
    """[count] float32 from the start of a cache line."""
    room = np.empty(count + CACHE_LINE // 4, np.float32)
    skip = (-np.int64(room.ctypes.data) % CACHE_LINE) // 4
    return room[skip : skip + count]


@called
def _composite(
    state: F32,
    positions: I32,
    batch: F32,
    masks: U32,
    least: F32,
    splats: F32,
    mine: U32,
    x0: np.float32,
    y0: np.float32,
    stop: np.float32,
    closed: np.float32,
) -> int:
    """Composite the splats `mine` onto the tile at (x0, y0); returns how many times a block took one."""
    for block in range(LANES):
        for lane in range(BLOCK):
            state[block * BLOCK + lane] = f32(1) if lane < LANES else f32(0)
    open_blocks, blocks = ALL_BLOCKS, 0
    for begin in range(0, len(mine), BATCH):
        count = min(BATCH, len(mine) - begin)
        for k in range(begin + BATCH, min(begin + 2 * BATCH, len(mine))):
            prefetch(splats, COLUMNS * np.int64(mine[k]))
            prefetch(splats, COLUMNS * np.int64(mine[k]) + COLUMNS - 1)
        for k in range(count):
            masks[k] = look_up(batch, least, k, splats, mine[begin + k], x0, y0) & open_blocks
        for k in range(count):
            mask = masks[k]
            while mask:
                block = lowest_bit(mask)
                mask &= mask - u32(1)
                left = x0 + f32(u32(4) * (u32(block) & u32(3)))
                top = y0 + f32(u32(4) * (u32(block) >> u32(2)))
                _composite_block(
                    state, positions, u64(BLOCK) * block, batch, k, left, top, stop, np.int32(begin + k + 1)
                )
                blocks += 1
        open_blocks = _open(state, closed)
        if not open_blocks:
            break
    return blocks


@inlined
def look_up(
    batch: F32, least: F32, k: int, splats: F32, splat: int, x0: np.float32, y0: np.float32
) -> np.uint32:
    """Copy a splat into row k of `batch`; returns the blocks that it can reach, one bit each.

    The least value of the conic's form over a block lies, unless the centre is inside, on the side nearest in
    x or on the side nearest in y.
    """
    for column in range(COLUMNS):
        batch[k, column] = splats[splat, column]
    x, y = batch[k, CENTRE_X], batch[k, CENTRE_Y]
    a, b, c = batch[k, CONIC_XX], batch[k, CONIC_XY], batch[k, CONIC_YY]
    reach, u_of_v, v_of_u = batch[k, REACH], batch[k, U_OF_V], batch[k, V_OF_U]
    for block in range(LANES):
        u0, v0 = x0 + f32(4 * (block & 3)) - x, y0 + f32(4 * (block >> 2)) - y
        u1, v1 = u0 + f32(3), v0 + f32(3)
        near_u, near_v = min(max(f32(0), u0), u1), min(max(f32(0), v0), v1)
        v, u = min(max(v_of_u * near_u, v0), v1), min(max(u_of_v * near_v, u0), u1)
        at_u = a * near_u * near_u + f32(2) * b * near_u * v + c * v * v
        at_v = a * u * u + f32(2) * b * u * near_v + c * near_v * near_v
        least[block] = min(at_u, at_v)
    beyond: np.uint32 = lanes_above(least, 0, reach)
    return u32(ALL_BLOCKS ^ beyond)


@inlined
def _composite_block(
    state: F32,
    last: I32,
    base: np.uint64,
    batch: F32,
    k: int,
    left: np.float32,
    top: np.float32,
    stop: np.float32,
    position: np.int32,
) -> None:
    """Composite splat k of the batch onto the block whose first pixel is (left, top).

    The transmittance of a pixel that has stopped is kept negated: it fails the test against `stop` ever after.
    """
    x, y, opacity = batch[k, CENTRE_X], batch[k, CENTRE_Y], batch[k, OPACITY]
    a, b, c = f32(-0.5) * batch[k, CONIC_XX], batch[k, CONIC_XY], f32(-0.5) * batch[k, CONIC_YY]
    red, green, blue = batch[k, RED], batch[k, GREEN], batch[k, BLUE]
    for i in range(LANES):
        lane = base + u64(i)
        dx, dy = x - (left + f32(i & 3)), y - (top + f32(i >> 2))
        power = (a * dx * dx + c * dy * dy) - b * dx * dy
        alpha = opacity * exponential(power)
        alpha = ALPHA_MAX if alpha > ALPHA_MAX else alpha
        before = state[lane]
        after = before * (f32(1) - alpha)
        seen = (power <= f32(0)) & (alpha >= ALPHA_MIN)
        added = seen & (after >= stop)
        weight = before * alpha if added else f32(0)
        kept = -abs(before) if seen else before
        state[lane] = after if added else kept
        state[lane + u64(RED_LANES)] = fma(weight, red, state[lane + u64(RED_LANES)])
        state[lane + u64(GREEN_LANES)] = fma(weight, green, state[lane + u64(GREEN_LANES)])
        state[lane + u64(BLUE_LANES)] = fma(weight, blue, state[lane + u64(BLUE_LANES)])
        last[lane + u64(LAST_LANES)] = position if added else last[lane + u64(LAST_LANES)]


@inlined
def _open(state: F32, closed: np.float32) -> np.uint32:
    """The blocks where a pixel can still take a splat, one bit each."""
    mask = u32(0)
    for block in range(LANES):
        if lanes_above(state, block * BLOCK, closed):
            mask |= u32(1 << block)
    return mask


@called
def _write(
    state: F32, positions: I32, x0: int, y0: int, background: F32, colour: F32, transmittance: F32, last: I32
) -> None:
    """The part of the tile at (x0, y0) that lies in the image, over the background."""
    for y in range(y0, min(y0 + TILE, transmittance.shape[0])):
        for x in range(x0, min(x0 + TILE, transmittance.shape[1])):
            row, column = y - y0, x - x0
            block = 4 * (row >> 2) + (column >> 2)
            lane = BLOCK * block + 4 * (row & 3) + (column & 3)
            left = abs(state[lane])
            transmittance[y, x], last[y, x] = left, positions[lane + LAST_LANES]
            colour[y, x, 0] = state[lane + RED_LANES] + left * background[0]
            colour[y, x, 1] = state[lane + GREEN_LANES] + left * background[1]
            colour[y, x, 2] = state[lane + BLUE_LANES] + left * background[2]
