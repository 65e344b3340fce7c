"""Gradients of the `cpu` compositing: 16x16 tiles, back to front, 16 lanes at a time.

A pixel's transmittance before a splat is that behind it over 1 - alpha. Alphas are computed as in the forward
kernel, so the same splats count. Each (tile, splat) pair has its own row, so no two threads add to one place.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import prange

from avatar_runtime import F32, I32, I64, U32
from avatar_runtime.backends.cpu import (
    exponential,
    fma,
    inlined,
    kernel,
    lanes_above,
    lowest_bit,
    prefetch,
    take_next,
)
from avatar_runtime.backends.cpu.draw import (
    ALPHA_MAX,
    ALPHA_MIN,
    BLUE,
    CENTRE_X,
    CENTRE_Y,
    COLUMNS,
    CONIC_XX,
    CONIC_XY,
    CONIC_YY,
    GREEN,
    LANES,
    OPACITY,
    RED,
    TILE,
    aligned,
    look_up,
)
from avatar_trainer.raster.reduce import sum_of_16

f32, u32, u64 = np.float32, np.uint32, np.uint64
# A row: the sums over the pixels of s, s dx, s dy, s dx dx, s dx dy, s dy dy, s being the gradient of the exponent
# and (dx, dy) the centre minus the pixel; then the gradient of the colour.
S, S_X, S_Y, S_XX, S_XY, S_YY, S_RED, S_GREEN, S_BLUE = range(9)
ROW = 9
AHEAD = 12  # splats between the prefetch of one and its use
# Where a block's state keeps, of its 16 pixels: the transmittance in front of the splats done, the sum of what these
# and the background add to the colour times its gradient, that gradient, the position of the last splat added.
BEHIND, REST, GRAD_RED, GRAD_GREEN, GRAD_BLUE, LAST = (LANES * k for k in range(6))
BLOCK = 6 * LANES


@kernel(parallel=True)
def composite_tiles_backward(
    splats: F32,  # [N, COLUMNS] as `screen.py` says
    tiles: I32,  # [N, 4] touched tiles
    first_row: I64,  # [N] where a splat's rows begin, one for each of its tiles, row by row
    members: U32,  # [P] ids, tile by tile, front to back
    starts: I64,  # [tiles + 1]
    transmittance: F32,  # [H, W] as the forward kernel left it, like `last`
    last: I32,  # [H, W]
    grad_colour: F32,  # [H, W, 3] gradient of the colour before the background
    grad_transmittance: F32,  # [H, W] gradient of the transmittance, the background's part included
    workers: int,
    rows: F32,  # [P, ROW] out
) -> None:
    """Fill every row. The workers take tiles from one counter."""
    counter = np.zeros(1, np.int64)
    for _ in prange(workers):
        _work(
            counter,
            splats,
            tiles,
            first_row,
            members,
            starts,
            transmittance,
            last,
            grad_colour,
            grad_transmittance,
            rows,
        )


@kernel()
def _work(
    counter: I64,
    splats: F32,
    tiles: I32,
    first_row: I64,
    members: U32,
    starts: I64,
    transmittance: F32,
    last: I32,
    grad_colour: F32,
    grad_transmittance: F32,
    rows: F32,
) -> Any:
    columns = -(-transmittance.shape[1] // TILE)
    state, sums, least = aligned(LANES * BLOCK), aligned(LANES * ROW), aligned(LANES)
    splat_row = aligned(COLUMNS).reshape(1, COLUMNS)
    deepest = aligned(LANES)
    while True:
        tile = take_next(counter)
        if tile >= len(starts) - 1:
            return
        row, column = tile // columns, tile % columns
        x0, y0 = TILE * column, TILE * row
        _read(state, deepest, x0, y0, transmittance, last, grad_colour, grad_transmittance)
        mine = members[starts[tile] : starts[tile + 1]]
        for k in range(len(mine) - 1, -1, -1):
            ahead = np.int64(mine[max(k - AHEAD, 0)])
            prefetch(splats, COLUMNS * ahead)
            prefetch(splats, COLUMNS * ahead + COLUMNS - 1)
            prefetch(tiles, 4 * ahead)
            prefetch(first_row, ahead)
            i = mine[k]
            wide = tiles[i, 2] - tiles[i, 0]
            at = first_row[i] + (row - tiles[i, 1]) * wide + column - tiles[i, 0]
            mask = lanes_above(deepest, 0, f32(k))
            if mask:
                mask &= look_up(splat_row, least, 0, splats, i, f32(x0), f32(y0))
            if mask:
                _clear(sums)
                _take(state, sums, splat_row, mask, f32(x0), f32(y0), f32(k + 1))
                _total(sums, rows, at)
            else:
                for j in range(ROW):
                    rows[at, j] = f32(0)


@kernel()
def _read(
    state: F32,
    deepest: F32,
    x0: int,
    y0: int,
    transmittance: F32,
    last: I32,
    grad_colour: F32,
    grad_transmittance: F32,
) -> None:
    """The state of the tile at (x0, y0); a pixel outside the image has no splat."""
    height, width = transmittance.shape
    state[:], deepest[:] = f32(0), f32(0)
    for y in range(y0, min(y0 + TILE, height)):
        for x in range(x0, min(x0 + TILE, width)):
            row, column = u64(y - y0), u64(x - x0)
            block = u64(4) * (row >> u64(2)) + (column >> u64(2))
            lane = u64(BLOCK) * block + u64(4) * (row & u64(3)) + (column & u64(3))
            left, position = transmittance[y, x], f32(last[y, x])
            state[lane + u64(BEHIND)], state[lane + u64(REST)] = left, grad_transmittance[y, x] * left
            state[lane + u64(GRAD_RED)], state[lane + u64(GRAD_GREEN)] = (
                grad_colour[y, x, 0],
                grad_colour[y, x, 1],
            )
            state[lane + u64(GRAD_BLUE)], state[lane + u64(LAST)] = grad_colour[y, x, 2], position
            deepest[block] = max(deepest[block], position)


@inlined
def _clear(sums: F32) -> None:
    for lane in range(LANES * ROW):
        sums[lane] = f32(0)


@inlined
def _take(
    state: F32, sums: F32, splat: F32, mask: np.uint32, x0: np.float32, y0: np.float32, position: np.float32
) -> None:
    """Take one splat out of the blocks of `mask`."""
    while mask:
        block = lowest_bit(mask)
        mask &= mask - u32(1)
        left = x0 + f32(u32(4) * (u32(block) & u32(3)))
        top = y0 + f32(u32(4) * (u32(block) >> u32(2)))
        _block_backward(state, u64(BLOCK) * block, sums, splat, left, top, position)


@inlined
def _block_backward(
    state: F32,
    base: np.uint64,
    sums: F32,
    splat: F32,
    left: np.float32,
    top: np.float32,
    position: np.float32,
) -> None:
    """Take the splat out of the block whose first pixel is (left, top), and add to its row."""
    x, y, opacity = splat[0, CENTRE_X], splat[0, CENTRE_Y], splat[0, OPACITY]
    a, b, c = f32(-0.5) * splat[0, CONIC_XX], splat[0, CONIC_XY], f32(-0.5) * splat[0, CONIC_YY]
    red, green, blue = splat[0, RED], splat[0, GREEN], splat[0, BLUE]
    for i in range(LANES):
        lane = base + u64(i)
        dx, dy = x - (left + f32(i & 3)), y - (top + f32(i >> 2))
        power = (a * dx * dx + c * dy * dy) - b * dx * dy
        raw = opacity * exponential(power)
        alpha = ALPHA_MAX if raw > ALPHA_MAX else raw
        added = (power <= f32(0)) & (alpha >= ALPHA_MIN) & (position <= state[lane + u64(LAST)])
        inverse = f32(1) / (f32(1) - alpha)
        behind, rest = state[lane + u64(BEHIND)], state[lane + u64(REST)]
        before = behind * inverse
        grad_red, grad_green = state[lane + u64(GRAD_RED)], state[lane + u64(GRAD_GREEN)]
        grad_blue = state[lane + u64(GRAD_BLUE)]
        shade = fma(grad_red, red, fma(grad_green, green, grad_blue * blue))
        weight = before * alpha if added else f32(0)
        state[lane + u64(BEHIND)] = before if added else behind
        state[lane + u64(REST)] = fma(weight, shade, rest)
        slope = (before * shade - rest * inverse) * alpha
        s = slope if added & (raw <= ALPHA_MAX) else f32(0)
        sx, sy = s * dx, s * dy
        sums[i] += s
        sums[i + S_X * LANES] += sx
        sums[i + S_Y * LANES] += sy
        sums[i + S_XX * LANES] = fma(sx, dx, sums[i + S_XX * LANES])
        sums[i + S_XY * LANES] = fma(sx, dy, sums[i + S_XY * LANES])
        sums[i + S_YY * LANES] = fma(sy, dy, sums[i + S_YY * LANES])
        sums[i + S_RED * LANES] = fma(weight, grad_red, sums[i + S_RED * LANES])
        sums[i + S_GREEN * LANES] = fma(weight, grad_green, sums[i + S_GREEN * LANES])
        sums[i + S_BLUE * LANES] = fma(weight, grad_blue, sums[i + S_BLUE * LANES])


@inlined
def _total(sums: F32, rows: F32, at: int) -> None:
    for j in range(ROW):
        rows[at, j] = sum_of_16(sums, j * LANES)
