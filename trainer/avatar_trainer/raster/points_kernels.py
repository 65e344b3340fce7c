"""The compositing kernels of point splatting: bands of pixel rows, a block of 4x4 pixels at a time, disc by disc.

One thread computes a whole band, and a disc has its own row for every band it meets, so no two threads add to one
place. Backward, a pixel's transmittance in front of a disc is that behind it over 1 - alpha.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange

from avatar_runtime import F32, I32, I64, U32
from avatar_runtime.backends.cpu import fma, inlined, kernel, prefetch, take_next
from avatar_runtime.backends.cpu.draw import aligned
from avatar_trainer.raster import points_screen
from avatar_trainer.raster.reduce import sum_of_16

f32, u64 = np.float32, np.uint64
BAND = 16  # pixel rows
SIDE = 4  # pixels of a block, across and down
LANES = 16
AHEAD = 12  # discs between the prefetch of one and its use
COLUMNS = 8  # of a disc; half a cache line
CENTRE_X, CENTRE_Y, RADIUS, OPACITY, RED, GREEN, BLUE = range(7)
# A row of gradients: the sums over the pixels of s fall, s dx, s dy, s r^2, s being the gradient of alpha over the
# opacity, fall 1 - r^2 / R^2 and (dx, dy) the centre minus the pixel; then the gradient of the colour.
S_FALL, S_X, S_Y, S_SQUARE, S_RED, S_GREEN, S_BLUE = range(7)
ROW = 7
ALPHA_MAX, STOP = f32(points_screen.ALPHA_MAX), f32(points_screen.STOP)
# What a block's state keeps of its 16 pixels, forward: transmittance, colour, position of the last disc added.
# Backward: transmittance in front of the discs done, gradient of the colour, that position, and what these discs and
# the background add to the colour times its gradient. A pixel beyond the image's edge takes no disc.
LEFT, SUM_RED, SUM_GREEN, SUM_BLUE, LAST, REST = (LANES * k for k in range(6))
GRAD_RED, GRAD_GREEN, GRAD_BLUE = SUM_RED, SUM_GREEN, SUM_BLUE
BLOCK = 6 * LANES


@kernel(parallel=True)
def composite_bands(
    discs: F32,  # [N, COLUMNS]
    bands: I32,  # [N, 4] as a Screen's tiles, one tile a band
    first_row: I64,  # [N + 1] where a disc's rows begin, one for each of its bands
    members: U32,  # [P] discs, band by band, front to back
    starts: I64,  # [bands + 1]
    background: F32,  # [3]
    workers: int,
    colour: F32,  # [H, W, 3] out
    transmittance: F32,  # [H, W] out
    last: F32,  # [H, W] out: the position in its band of the last disc added, from 1; 0: none
    weight: F32,  # [P] out: a disc's largest in a band
) -> None:
    """Composite every band. The workers take bands from one counter."""
    counter = np.zeros(1, np.int64)
    for _ in prange(workers):
        _work(
            counter, discs, bands, first_row, members, starts, background, colour, transmittance, last, weight
        )


@kernel()
def _work(
    counter: I64,
    discs: F32,
    bands: I32,
    first_row: I64,
    members: U32,
    starts: I64,
    background: F32,
    colour: F32,
    transmittance: F32,
    last: F32,
    weight: F32,
) -> Any:
    height, width = last.shape
    columns = -(-width // SIDE)
    state, largest, disc = aligned(BAND // SIDE * columns * BLOCK), aligned(LANES), aligned(COLUMNS)
    while True:
        band = take_next(counter)
        if band >= len(starts) - 1:
            return
        y0, y1 = BAND * band, min(BAND * (band + 1), height)
        state[:] = f32(0)
        for y in range(y0, y1):
            for x in range(width):
                state[_place(x, y - y0, columns)] = f32(1)
        for k in range(starts[band], starts[band + 1]):
            i = _fetch(disc, discs, first_row, members, k, min(k + AHEAD, len(members) - 1))
            largest[:] = f32(0)
            _add(state, largest, disc, y0, y1, width, columns, f32(k - starts[band] + 1))
            weight[first_row[i] + band - bands[i, 1]] = _most(largest)
        _write(state, y0, y1, columns, background, colour, transmittance, last)


@inlined
def _most(lanes: F32) -> np.float32:
    """The largest of 16 lanes; changes them."""
    for half in (8, 4, 2, 1):
        for lane in range(half):
            other = lanes[lane + half]
            lanes[lane] = other if other > lanes[lane] else lanes[lane]
    result: np.float32 = lanes[0]
    return result


@inlined
def _place(x: int, row: int, columns: int) -> int:
    """Where the state of pixel (x, row) of the band begins."""
    return BLOCK * ((row >> 2) * columns + (x >> 2)) + SIDE * (row & 3) + (x & 3)


@inlined
def _fetch(disc: F32, discs: F32, first_row: I64, members: U32, k: int, ahead: int) -> Any:
    """Copy the disc of pair k into `disc` and ask for that of pair `ahead`; returns which disc it is."""
    i, following = members[k], np.int64(members[ahead])
    prefetch(discs, COLUMNS * following)
    prefetch(first_row, following)
    for column in range(COLUMNS):
        disc[column] = discs[i, column]
    return i


@inlined
def _span(centre: np.float32, radius: np.float32, low: int, high: int) -> tuple[int, int]:
    """The blocks, from the image's edge, of the pixels low..high that a disc can reach; ends excluded."""
    begin = math.ceil(max(centre - radius, f32(low))) // SIDE
    return begin, math.floor(min(centre + radius, f32(high - 1))) // SIDE + 1


@inlined
def _add(
    state: F32, largest: F32, disc: F32, y0: int, y1: int, width: int, columns: int, position: np.float32
) -> None:
    """Composite the disc into the rows from y0 to y1."""
    left, right = _span(disc[CENTRE_X], disc[RADIUS], 0, width)
    top, bottom = _span(disc[CENTRE_Y], disc[RADIUS], y0, y1)
    for row in range(top, bottom):
        for column in range(left, right):
            base = u64(BLOCK * ((row - y0 // SIDE) * columns + column))
            _add_block(state, base, largest, disc, f32(SIDE * column), f32(SIDE * row), position)


@inlined
def _add_block(
    state: F32, base: np.uint64, largest: F32, disc: F32, x0: np.float32, y0: np.float32, position: np.float32
) -> None:
    """Composite the disc into the block at (x0, y0); the transmittance of a pixel that has stopped is kept negated."""
    inverse, opacity = f32(1) / (disc[RADIUS] * disc[RADIUS]), disc[OPACITY]
    red, green, blue = disc[RED], disc[GREEN], disc[BLUE]
    x, y = disc[CENTRE_X], disc[CENTRE_Y]
    for i in range(LANES):
        lane = base + u64(i)
        dx, dy = x - (x0 + f32(i & 3)), y - (y0 + f32(i >> 2))
        fall = f32(1) - (dx * dx + dy * dy) * inverse
        raw = opacity * fall
        alpha = ALPHA_MAX if raw > ALPHA_MAX else raw
        before = state[lane]
        after = before * (f32(1) - alpha)
        seen = (fall > f32(0)) & (before > f32(0))
        added = seen & (after >= STOP)
        weight = before * alpha if added else f32(0)
        kept = -abs(before) if seen else before
        state[lane] = after if added else kept
        state[lane + u64(SUM_RED)] = fma(weight, red, state[lane + u64(SUM_RED)])
        state[lane + u64(SUM_GREEN)] = fma(weight, green, state[lane + u64(SUM_GREEN)])
        state[lane + u64(SUM_BLUE)] = fma(weight, blue, state[lane + u64(SUM_BLUE)])
        state[lane + u64(LAST)] = position if added else state[lane + u64(LAST)]
        largest[i] = weight if weight > largest[i] else largest[i]


@inlined
def _write(
    state: F32, y0: int, y1: int, columns: int, background: F32, colour: F32, transmittance: F32, last: F32
) -> None:
    for y in range(y0, y1):
        for x in range(last.shape[1]):
            at = _place(x, y - y0, columns)
            left = abs(state[at])
            transmittance[y, x], last[y, x] = left, state[at + LAST]
            colour[y, x, 0] = state[at + SUM_RED] + left * background[0]
            colour[y, x, 1] = state[at + SUM_GREEN] + left * background[1]
            colour[y, x, 2] = state[at + SUM_BLUE] + left * background[2]


@kernel(parallel=True)
def composite_bands_backward(
    discs: F32,  # [N, COLUMNS], like all that follow as `composite_bands` had or left them
    bands: I32,
    first_row: I64,
    members: U32,
    starts: I64,
    transmittance: F32,
    last: F32,
    grad_colour: F32,  # [H, W, 3] gradient of the colour
    grad_transmittance: F32,  # [H, W] gradient of the transmittance, the background's part included
    workers: int,
    rows: F32,  # [P, ROW] out
) -> None:
    """Fill every row."""
    counter = np.zeros(1, np.int64)
    for _ in prange(workers):
        _work_backward(
            counter,
            discs,
            bands,
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
def _work_backward(
    counter: I64,
    discs: F32,
    bands: I32,
    first_row: I64,
    members: U32,
    starts: I64,
    transmittance: F32,
    last: F32,
    grad_colour: F32,
    grad_transmittance: F32,
    rows: F32,
) -> Any:
    height, width = last.shape
    columns = -(-width // SIDE)
    state, sums, disc = aligned(BAND // SIDE * columns * BLOCK), aligned(LANES * ROW), aligned(COLUMNS)
    while True:
        band = take_next(counter)
        if band >= len(starts) - 1:
            return
        y0, y1 = BAND * band, min(BAND * (band + 1), height)
        _read(state, y0, y1, columns, transmittance, last, grad_colour, grad_transmittance)
        for k in range(starts[band + 1] - 1, starts[band] - 1, -1):
            i = _fetch(disc, discs, first_row, members, k, max(k - AHEAD, 0))
            for lane in range(LANES * ROW):
                sums[lane] = f32(0)
            _take(state, sums, disc, y0, y1, width, columns, f32(k - starts[band] + 1))
            for j in range(ROW):
                rows[first_row[i] + band - bands[i, 1], j] = sum_of_16(sums, j * LANES)


@inlined
def _read(
    state: F32,
    y0: int,
    y1: int,
    columns: int,
    transmittance: F32,
    last: F32,
    grad_colour: F32,
    grad_transmittance: F32,
) -> None:
    """The state of the rows from y0 to y1."""
    state[:] = f32(0)
    for y in range(y0, y1):
        for x in range(last.shape[1]):
            at, left = _place(x, y - y0, columns), transmittance[y, x]
            state[at], state[at + REST] = left, grad_transmittance[y, x] * left
            state[at + LAST] = last[y, x]
            state[at + GRAD_RED], state[at + GRAD_GREEN] = grad_colour[y, x, 0], grad_colour[y, x, 1]
            state[at + GRAD_BLUE] = grad_colour[y, x, 2]


@inlined
def _take(
    state: F32, sums: F32, disc: F32, y0: int, y1: int, width: int, columns: int, position: np.float32
) -> None:
    left, right = _span(disc[CENTRE_X], disc[RADIUS], 0, width)
    top, bottom = _span(disc[CENTRE_Y], disc[RADIUS], y0, y1)
    for row in range(top, bottom):
        for column in range(left, right):
            base = u64(BLOCK * ((row - y0 // SIDE) * columns + column))
            _take_block(state, base, sums, disc, f32(SIDE * column), f32(SIDE * row), position)


@inlined
def _take_block(
    state: F32, base: np.uint64, sums: F32, disc: F32, x0: np.float32, y0: np.float32, position: np.float32
) -> None:
    """Take the disc out of the block at (x0, y0), and add to its row."""
    inverse, opacity = f32(1) / (disc[RADIUS] * disc[RADIUS]), disc[OPACITY]
    red, green, blue = disc[RED], disc[GREEN], disc[BLUE]
    x, y = disc[CENTRE_X], disc[CENTRE_Y]
    for i in range(LANES):
        lane = base + u64(i)
        dx, dy = x - (x0 + f32(i & 3)), y - (y0 + f32(i >> 2))
        square = dx * dx + dy * dy
        fall = f32(1) - square * inverse
        raw = opacity * fall
        alpha = ALPHA_MAX if raw > ALPHA_MAX else raw
        added = (fall > f32(0)) & (position <= state[lane + u64(LAST)])
        through = f32(1) / (f32(1) - alpha)
        behind, rest = state[lane], state[lane + u64(REST)]
        before = behind * through
        grad_red, grad_green = state[lane + u64(GRAD_RED)], state[lane + u64(GRAD_GREEN)]
        grad_blue = state[lane + u64(GRAD_BLUE)]
        shade = fma(grad_red, red, fma(grad_green, green, grad_blue * blue))
        weight = before * alpha if added else f32(0)
        state[lane] = before if added else behind
        state[lane + u64(REST)] = fma(weight, shade, rest)
        slope = before * shade - rest * through
        s = slope if added & (raw <= ALPHA_MAX) else f32(0)
        sums[i] = fma(s, fall, sums[i])
        sums[i + S_X * LANES] = fma(s, dx, sums[i + S_X * LANES])
        sums[i + S_Y * LANES] = fma(s, dy, sums[i + S_Y * LANES])
        sums[i + S_SQUARE * LANES] = fma(s, square, sums[i + S_SQUARE * LANES])
        sums[i + S_RED * LANES] = fma(weight, grad_red, sums[i + S_RED * LANES])
        sums[i + S_GREEN * LANES] = fma(weight, grad_green, sums[i + S_GREEN * LANES])
        sums[i + S_BLUE * LANES] = fma(weight, grad_blue, sums[i + S_BLUE * LANES])
