"""SSIM: the value and gradient of `losses.ssim_definition`.

A row of an image [H, W, 3] is one line of 3 W numbers, in which the window's taps are 3 apart, so all channels are
computed at once. Lines have 15 zeros at both ends, images five lines of zeros above and below: the padding of the
window.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, F64
from avatar_runtime.backends.cpu import Scalar, inlined, kernel
from avatar_trainer.kernels.arrays import plain

HALF = 5  # pixels of the window beside its centre
MARGIN = 3 * HALF
WEIGHT = np.exp(-((np.arange(HALF + 1) - HALF) ** 2) / (2 * 1.5**2))
W0, W1, W2, W3, W4, W5 = (np.float32(w) for w in WEIGHT / (2 * WEIGHT.sum() - WEIGHT[HALF]))
C1, C2 = np.float32(0.01**2), np.float32(0.03**2)
ONE, TWO = np.float32(1), np.float32(2)


def ssim_cpu(a: Tensor, b: Tensor) -> Tensor:
    """As `losses.ssim_definition` of [H, W, 3] images, float32; differentiable in `a`.

    Raises ValueError if `b` needs a gradient, the shapes differ, or an image is not float32 on the CPU.
    """
    if b.requires_grad:
        raise ValueError("ssim_cpu has no gradient for its second image")
    if a.shape != b.shape or a.dim() != 3 or a.shape[2] != 3:
        raise ValueError(
            f"images of shape {tuple(a.shape)} and {tuple(b.shape)} stand where [H, W, 3] are needed"
        )
    result: Tensor = _Ssim.apply(a, b)  # type: ignore[no-untyped-call]
    return result


class _Ssim(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, a: Tensor, b: Tensor) -> Tensor:
        height, width = a.shape[0], 3 * a.shape[1]
        x, y = plain(a, height, width), plain(b, height, width)
        across = np.zeros((5, height + 2 * HALF, width), np.float32)
        _blur_along(x, y, across)
        total = np.empty(height)
        wanted = bool(ctx.needs_input_grad[0])
        slope = np.zeros((3, height + 2 * HALF, width) if wanted else (3, 0, 0), np.float32)
        _compare(across, wanted, total, slope)
        ctx.kept = (x, y, slope)
        return torch.tensor(total.sum() / x.size, dtype=torch.float32)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        x, y, slope = ctx.kept
        out = torch.empty((len(x), x.shape[1] // 3, 3))
        _blur_back(x, y, slope, np.float32(float(gradient) / x.size), plain(out, *x.shape))
        return out, None


@inlined
def taps(a: Scalar, b: Scalar, c: Scalar, d: Scalar, e: Scalar, f: Scalar) -> Scalar:
    """The window over sums of pairs, outermost first, and the centre."""
    return W0 * a + W1 * b + W2 * c + W3 * d + W4 * e + W5 * f


@inlined
def along(line: F32, i: int) -> Scalar:
    """The window over number `i` of a line with its margins."""
    return taps(
        line[i] + line[i + 30],
        line[i + 3] + line[i + 27],
        line[i + 6] + line[i + 24],
        line[i + 9] + line[i + 21],
        line[i + 12] + line[i + 18],
        line[i + 15],
    )


@inlined
def down(plane: F32, row: int, i: int) -> Scalar:
    """The window over number `i` of line `row` of an image with its margins, over the lines."""
    return taps(
        plane[row, i] + plane[row + 10, i],
        plane[row + 1, i] + plane[row + 9, i],
        plane[row + 2, i] + plane[row + 8, i],
        plane[row + 3, i] + plane[row + 7, i],
        plane[row + 4, i] + plane[row + 6, i],
        plane[row + 5, i],
    )


@kernel(parallel=True)
def _blur_along(x: F32, y: F32, out: F32) -> None:
    """`out` [5, H + 10, 3 W]: x, y, xx, yy, xy under the window along the lines."""
    height, width = x.shape
    for row in numba.prange(height):
        line = np.zeros((5, width + 2 * MARGIN), np.float32)
        for i in range(width):
            p, q = x[row, i], y[row, i]
            line[0, MARGIN + i] = p
            line[1, MARGIN + i] = q
            line[2, MARGIN + i] = p * p
            line[3, MARGIN + i] = q * q
            line[4, MARGIN + i] = p * q
        for plane in range(5):
            source, to = line[plane], out[plane, HALF + row]
            for i in range(width):
                to[i] = along(source, i)


@kernel(parallel=True)
def _compare(across: F32, wanted: bool, total: F64, slope: F32) -> None:
    """Sums of SSIM by line in `total` [H]; its derivative by the blurred x, xx and xy in `slope`, where `wanted`."""
    width = across.shape[2]
    for row in numba.prange(len(total)):
        value = np.empty(width, np.float32)
        blurred = np.empty((5, width), np.float32)
        for plane in range(5):
            for i in range(width):
                blurred[plane, i] = down(across[plane], row, i)
        for i in range(width):
            value[i] = similarity(blurred[0, i], blurred[1, i], blurred[2, i], blurred[3, i], blurred[4, i])
        if wanted:
            for i in range(width):
                by_x, by_xx, by_xy = slopes(
                    blurred[0, i], blurred[1, i], blurred[2, i], blurred[3, i], blurred[4, i]
                )
                slope[0, HALF + row, i] = by_x
                slope[1, HALF + row, i] = by_xx
                slope[2, HALF + row, i] = by_xy
        added = 0.0
        for i in range(width):
            added += value[i]
        total[row] = added


@inlined
def similarity(x: Scalar, y: Scalar, xx: Scalar, yy: Scalar, xy: Scalar) -> Scalar:
    """SSIM of blurred values."""
    above = (TWO * x * y + C1) * (TWO * (xy - x * y) + C2)
    below = (x * x + y * y + C1) * ((xx - x * x) + (yy - y * y) + C2)
    return above / below


@inlined
def slopes(x: Scalar, y: Scalar, xx: Scalar, yy: Scalar, xy: Scalar) -> tuple[Scalar, Scalar, Scalar]:
    """Derivatives of SSIM by blurred x, xx, xy."""
    a, b = TWO * x * y + C1, TWO * (xy - x * y) + C2
    c, d = x * x + y * y + C1, (xx - x * x) + (yy - y * y) + C2
    scale = ONE / (c * d)
    s = a * b * scale
    # d a / dx = 2 y, d b / dx = -2 y, d c / dx = 2 x, d d / dx = -2 x
    by_x = TWO * (y * (b - a) * scale - x * s * (ONE / c - ONE / d))
    return by_x, -s / d, TWO * a * scale


@kernel(parallel=True)
def _blur_back(x: F32, y: F32, slope: F32, scale: Scalar, out: F32) -> None:
    """`out` [H, 3 W]: scale times (G by_x + 2 x G by_xx + y G by_xy), G the window over lines and along them."""
    height, width = x.shape
    for row in numba.prange(height):
        line = np.zeros((3, width + 2 * MARGIN), np.float32)
        for plane in range(3):
            for i in range(width):
                line[plane, MARGIN + i] = down(slope[plane], row, i)
        for i in range(width):
            by_x, by_xx, by_xy = along(line[0], i), along(line[1], i), along(line[2], i)
            out[row, i] = scale * (by_x + TWO * x[row, i] * by_xx + y[row, i] * by_xy)
