"""The kernels of point splatting: bands of pixel rows, each blended by one thread disc by disc.

A disc has a row of its own for every band it lies in, so nothing is added by two threads. Backward, a pixel's
transmittance in front of a disc is that behind it over 1 - alpha.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import prange

from avatar_runtime.avatar import F32, I32, I64, U32
from avatar_runtime.backends.cpu.jit import inlined, kernel
from avatar_runtime.backends.cpu.lanes import take_next
from avatar_trainer.raster import points_screen

f32 = np.float32
BAND = 16  # pixel rows
COLUMNS = 7  # of a disc: centre (2), radius, opacity, rgb (3)
X, Y, RADIUS, OPACITY, RED, GREEN, BLUE = range(COLUMNS)
ROW = COLUMNS  # gradients of the same
ALPHA_MAX, STOP = f32(points_screen.ALPHA_MAX), f32(points_screen.STOP)
# A pixel's state backward: the transmittance in front of the discs done, what these and the background add to the
# colour times its gradient, that gradient.
BEHIND, REST, OF_RED, OF_GREEN, OF_BLUE, STATE = 0, 1, 2, 3, 4, 5


@kernel(parallel=True)
def blend_bands(
    discs: F32,  # [M, COLUMNS]
    members: U32,  # [P] discs, band by band, front to back
    starts: I64,  # [bands + 1]
    first_band: I32,  # [M]
    first_pair: I64,  # [M + 1]
    background: F32,  # [3]
    workers: int,
    colour: F32,  # [H, W, 3] out
    transmittance: F32,  # [H, W] out
    last: I32,  # [H, W] out: the position in its band of the last disc added, from 1; 0: none
    weight: F32,  # [P, 1] out: a disc's largest in a band
) -> None:
    """Blend every band. The workers take bands from one counter."""
    counter = np.zeros(1, np.int64)
    for _ in prange(workers):
        _work(
            counter,
            discs,
            members,
            starts,
            first_band,
            first_pair,
            background,
            colour,
            transmittance,
            last,
            weight,
        )


@kernel()
def _work(
    counter: I64,
    discs: F32,
    members: U32,
    starts: I64,
    first_band: I32,
    first_pair: I64,
    background: F32,
    colour: F32,
    transmittance: F32,
    last: I32,
    weight: F32,
) -> Any:
    """Blend bands until none is left."""
    while True:
        band = take_next(counter)
        if band >= len(starts) - 1:
            return
        y0, y1 = BAND * band, min(BAND * (band + 1), len(last))
        colour[y0:y1], transmittance[y0:y1], last[y0:y1] = f32(0), f32(1), 0
        for k in range(starts[band], starts[band + 1]):
            i = members[k]
            position = np.int32(k - starts[band] + 1)
            weight[first_pair[i] + band - first_band[i], 0] = _add(
                discs, i, y0, y1, position, colour, transmittance, last
            )
        for y in range(y0, y1):
            for x in range(last.shape[1]):
                left = abs(transmittance[y, x])
                transmittance[y, x] = left
                for channel in range(3):
                    colour[y, x, channel] += left * background[channel]


@inlined
def _add(
    discs: F32, i: int, y0: int, y1: int, position: np.int32, colour: F32, transmittance: F32, last: I32
) -> np.float32:
    """Blend disc i into the rows from y0 to y1; returns its largest weight there.

    The transmittance of a pixel that has stopped is kept negated.
    """
    largest = f32(0)
    inverse = f32(1) / (discs[i, RADIUS] * discs[i, RADIUS])
    left, right = _span(discs[i, X], discs[i, RADIUS], 0, last.shape[1])
    top, bottom = _span(discs[i, Y], discs[i, RADIUS], y0, y1)
    for y in range(top, bottom):
        dy = discs[i, Y] - f32(y)
        for x in range(left, right):
            dx = discs[i, X] - f32(x)
            fall = f32(1) - (dx * dx + dy * dy) * inverse
            before = transmittance[y, x]
            if fall <= f32(0) or before < f32(0):
                continue
            alpha = min(discs[i, OPACITY] * fall, ALPHA_MAX)
            after = before * (f32(1) - alpha)
            if after < STOP:
                transmittance[y, x] = -before
                continue
            share = before * alpha
            transmittance[y, x], last[y, x] = after, position
            colour[y, x, 0] += share * discs[i, RED]
            colour[y, x, 1] += share * discs[i, GREEN]
            colour[y, x, 2] += share * discs[i, BLUE]
            largest = max(largest, share)
    return largest


@inlined
def _span(centre: np.float32, radius: np.float32, low: int, high: int) -> tuple[int, int]:
    """The pixels of low..high that a disc can reach; end excluded."""
    begin = max(low, math.ceil(max(centre - radius, f32(low))))
    end = min(high, math.floor(min(centre + radius, f32(high))) + 1)
    return begin, end


@kernel(parallel=True)
def blend_bands_backward(
    discs: F32,  # [M, COLUMNS], like all that follow as `blend_bands` had or left them
    members: U32,
    starts: I64,
    first_band: I32,
    first_pair: I64,
    transmittance: F32,
    last: I32,
    of_colour: F32,  # [H, W, 3] gradient of the colour
    of_transmittance: F32,  # [H, W] gradient of the transmittance, the background's part included
    workers: int,
    rows: F32,  # [P, ROW] out: gradients of each disc by band
) -> None:
    """Fill every row."""
    counter = np.zeros(1, np.int64)
    for _ in prange(workers):
        _work_backward(
            counter,
            discs,
            members,
            starts,
            first_band,
            first_pair,
            transmittance,
            last,
            of_colour,
            of_transmittance,
            rows,
        )


@kernel()
def _work_backward(
    counter: I64,
    discs: F32,
    members: U32,
    starts: I64,
    first_band: I32,
    first_pair: I64,
    transmittance: F32,
    last: I32,
    of_colour: F32,
    of_transmittance: F32,
    rows: F32,
) -> Any:
    """Go through bands until none is left."""
    state = np.empty((BAND, last.shape[1], STATE), np.float32)
    while True:
        band = take_next(counter)
        if band >= len(starts) - 1:
            return
        y0, y1 = BAND * band, min(BAND * (band + 1), len(last))
        for y in range(y0, y1):
            for x in range(last.shape[1]):
                pixel, left = state[y - y0, x], transmittance[y, x]
                pixel[BEHIND], pixel[REST] = left, of_transmittance[y, x] * left
                pixel[OF_RED], pixel[OF_GREEN] = of_colour[y, x, 0], of_colour[y, x, 1]
                pixel[OF_BLUE] = of_colour[y, x, 2]
        for k in range(starts[band + 1] - 1, starts[band] - 1, -1):
            i = members[k]
            row = rows[first_pair[i] + band - first_band[i]]
            _take(discs, i, y0, y1, np.int32(k - starts[band] + 1), state, last, row)


@inlined
def _take(discs: F32, i: int, y0: int, y1: int, position: np.int32, state: F32, last: I32, row: F32) -> None:
    """Take disc i out of the rows from y0 to y1; its gradients into `row`."""
    opacity, inverse = discs[i, OPACITY], f32(1) / (discs[i, RADIUS] * discs[i, RADIUS])
    red, green, blue = discs[i, RED], discs[i, GREEN], discs[i, BLUE]
    of_x, of_y, of_square, of_opacity = f32(0), f32(0), f32(0), f32(0)
    of_red, of_green, of_blue = f32(0), f32(0), f32(0)
    left, right = _span(discs[i, X], discs[i, RADIUS], 0, last.shape[1])
    top, bottom = _span(discs[i, Y], discs[i, RADIUS], y0, y1)
    for y in range(top, bottom):
        dy = discs[i, Y] - f32(y)
        for x in range(left, right):
            dx = discs[i, X] - f32(x)
            square = dx * dx + dy * dy
            fall = f32(1) - square * inverse
            if fall <= f32(0) or position > last[y, x]:
                continue
            pixel = state[y - y0, x]
            raw = opacity * fall
            alpha = min(raw, ALPHA_MAX)
            through = f32(1) / (f32(1) - alpha)
            before = pixel[BEHIND] * through
            shade = pixel[OF_RED] * red + pixel[OF_GREEN] * green + pixel[OF_BLUE] * blue
            share = before * alpha
            if raw <= ALPHA_MAX:
                slope = before * shade - pixel[REST] * through
                of_opacity += slope * fall
                of_x += slope * dx
                of_y += slope * dy
                of_square += slope * square
            pixel[BEHIND] = before
            pixel[REST] += share * shade
            of_red += share * pixel[OF_RED]
            of_green += share * pixel[OF_GREEN]
            of_blue += share * pixel[OF_BLUE]
    steep = f32(-2) * opacity * inverse
    row[X], row[Y] = steep * of_x, steep * of_y
    row[RADIUS], row[OPACITY] = -steep * of_square / discs[i, RADIUS], of_opacity
    row[RED], row[GREEN], row[BLUE] = of_red, of_green, of_blue


@kernel()
def gather(
    rows: F32,  # [P, C]
    first_pair: I64,  # [M + 1]
    largest: bool,  # of a disc's rows; else their sum, in order
    out: F32,  # [M, C]
) -> None:
    """What a disc's rows come to; 0 is the least."""
    for i in range(len(out)):
        for column in range(out.shape[1]):
            total = f32(0)
            for k in range(first_pair[i], first_pair[i + 1]):
                total = max(total, rows[k, column]) if largest else total + rows[k, column]
            out[i, column] = total
