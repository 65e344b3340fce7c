"""Compositing with the share that each splat has in each pixel, and the gradient of an image, in NumPy.

Backends give images alone. Here every pair of a splat and a pixel that it reaches is listed, so that contributions
and gradients are sums over the list. A band of rows is done at a time: its pixels are numbered in 16 bits, which
NumPy sorts in linear time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I64
from avatar_schema import constants

ALPHA_MIN = 1 / float(constants()["alpha_min_denominator"])
ALPHA_MAX = np.float32(constants()["alpha_max"])
BAND_PIXELS = 65536  # numbered by uint16
LEAST_TRANSMITTANCE = 1e-3  # pairs behind it are left out; they add less than a thousandth
TRANSMITTANCE_WEIGHT = 0.3  # of its squared error, against that of one colour
LARGEST_ERROR = 0.15  # errors count as if they were no larger: a few wild Gaussians do not rule the fit
OUTSIDE_WEIGHT = 0.2  # of errors where the target's alpha is below a half


@dataclass(frozen=True)
class Flat:
    """Splats on the screen, nearest first; those that are not drawn are left out."""

    row: I64  # [n] Gaussian id
    centre: F32  # [n, 2] pixels, pixel centres at integers
    conic: F32  # [n, 3] xx, xy, yy
    opacity: F32  # [n]
    rgb: F32  # [n, 3]


@dataclass(frozen=True)
class FlatGradient:
    """Gradients of a scalar by the fields of `Flat`."""

    centre: F64  # [n, 2]
    conic: F64  # [n, 3]
    opacity: F64  # [n]
    rgb: F64  # [n, 3]


@dataclass(frozen=True)
class _Pairs:
    """Pairs of a splat and a pixel of one band of rows, pixel by pixel, front to back."""

    first_row: int  # of the band
    rows: int
    splat: npt.NDArray[np.int32]  # [P] index into Flat
    pixel: npt.NDArray[np.uint16]  # [P] row-major in the band
    start: I64  # [pixels with a pair] index of their first pair
    filled: I64  # [pixels with a pair] which pixel it is
    alpha: F32  # [P]
    before: F32  # [P] transmittance in front of the splat


def contribution(flat: Flat, width: int, height: int) -> F64:
    """[n] sum over the pixels of transmittance times alpha."""
    total = np.zeros(len(flat.row))
    for pairs in _bands(flat, width, height):
        total += np.bincount(pairs.splat, pairs.alpha * pairs.before, len(total))
    return total


def shown(flat: Flat, width: int, height: int) -> F64:
    """[n] sum over the pixels of (transmittance times alpha)^2: what the square of an error of colour is times."""
    total = np.zeros(len(flat.row))
    for pairs in _bands(flat, width, height):
        total += np.bincount(pairs.splat, (pairs.alpha * pairs.before) ** 2, len(total))
    return total


def error_shares(flat: Flat, target_rgb: F32, target_transmittance: F32) -> F64:
    """[n] sum over the pixels that the target covers of transmittance times alpha times the squared error there."""
    height, width = target_transmittance.shape
    total = np.zeros(len(flat.row))
    for pairs in _bands(flat, width, height):
        window = slice(pairs.first_row, pairs.first_row + pairs.rows)
        weight = pairs.alpha * pairs.before
        error = -target_rgb[window].reshape(-1, 3)
        for k in range(3 if len(pairs.start) else 0):
            error[pairs.filled, k] += np.add.reduceat(weight * flat.rgb[pairs.splat, k], pairs.start)
        square = np.sum(error**2, axis=1)
        square[target_transmittance[window].reshape(-1) > 0.5] = 0
        total += np.bincount(pairs.splat, weight * square[pairs.pixel], len(total))
    return total


def squared_error(flat: Flat, target_rgb: F32, target_transmittance: F32) -> tuple[float, FlatGradient]:
    """(sum of squared errors, its gradient) of the image of `flat` over black against [H, W, 3] and [H, W]."""
    height, width = target_transmittance.shape
    n, loss = len(flat.row), 0.0
    sums = np.zeros((9, n))
    for pairs in _bands(flat, width, height):
        window = slice(pairs.first_row, pairs.first_row + pairs.rows)
        target = target_rgb[window].reshape(-1, 3)
        target_left = target_transmittance[window].reshape(-1)
        loss += _add_band(pairs, flat, width, target, target_left, sums)
    a, b, c = flat.conic.T.astype(np.float64)
    s, x, y, xx, xy, yy = sums[:6]
    return loss, FlatGradient(
        -np.stack([a * x + b * y, b * x + c * y], axis=1),
        np.stack([-0.5 * xx, -xy, -0.5 * yy], axis=1),
        s / flat.opacity,
        sums[6:].T.copy(),
    )


def _add_band(
    pairs: _Pairs,
    flat: Flat,
    width: int,
    target: F32,
    target_left: F32,
    sums: F64,  # [9, n] in and out: s, s dx, s dy, s dx dx, s dx dy, s dy dy, gradient of red, green, blue
) -> float:
    """Add one band's squared error to `sums`, s being the gradient of the exponent; returns the error."""
    n, at, pixel, start = len(flat.row), pairs.splat, pairs.pixel, pairs.start
    weight = pairs.alpha * pairs.before
    rgb = flat.rgb[at]
    drawn = np.zeros_like(target)
    left = np.ones(len(target), np.float32)
    if len(start):
        for k in range(3):
            drawn[pairs.filled, k] = np.add.reduceat(weight * rgb[:, k], start)
        left[pairs.filled] -= np.add.reduceat(weight, start)
    error = drawn - target
    error_left = left - target_left
    trust = np.where(target_left > 0.5, np.float32(OUTSIDE_WEIGHT), np.float32(1))
    error = np.clip(error, -LARGEST_ERROR, LARGEST_ERROR) * trust[:, None]
    error_left = np.clip(error_left, -LARGEST_ERROR, LARGEST_ERROR) * trust
    loss = float(np.sum(error * error) + TRANSMITTANCE_WEIGHT * np.sum(error_left * error_left))
    if not len(start):
        return loss
    grad = (2 * error)[pixel]
    # Compositing over black and over the weight of transmittance: one number that each splat adds to the loss.
    value = rgb[:, 0] * grad[:, 0] + rgb[:, 1] * grad[:, 1] + rgb[:, 2] * grad[:, 2]
    value -= (2 * TRANSMITTANCE_WEIGHT * error_left)[pixel]
    added = weight * value
    running = np.cumsum(added, dtype=np.float64)
    ends = running[np.append(start[1:], len(at)) - 1]
    behind = np.repeat(ends, np.diff(np.append(start, len(at)))) - running
    slope = pairs.before * value - (behind / (1 - pairs.alpha)).astype(np.float32)
    s = np.where(pairs.alpha < ALPHA_MAX, slope * pairs.alpha, np.float32(0))
    rows, columns = np.divmod(np.arange(len(target), dtype=np.int32), width)
    dx = flat.centre[at, 0] - columns.astype(np.float32)[pixel]
    dy = flat.centre[at, 1] - (rows + pairs.first_row).astype(np.float32)[pixel]
    sx, sy = s * dx, s * dy
    for k, values in enumerate((s, sx, sy, sx * dx, sx * dy, sy * dy)):
        sums[k] += np.bincount(at, values, n)
    for k in range(3):
        sums[6 + k] += np.bincount(at, weight * grad[:, k], n)
    return loss


def _bands(flat: Flat, width: int, height: int) -> Iterator[_Pairs]:
    """The image's pairs, a band at a time."""
    a, b, c = flat.conic.T
    with np.errstate(all="ignore"):
        reach = np.float32(2) * np.log(np.maximum(flat.opacity / np.float32(ALPHA_MIN), np.float32(1)))
        tall = np.sqrt(np.maximum(reach * a / (a * c - b * b), 0))
    low = np.nan_to_num(np.clip(np.ceil(flat.centre[:, 1] - tall), 0, height)).astype(np.int64)
    high = np.nan_to_num(np.clip(np.floor(flat.centre[:, 1] + tall) + 1, 0, height)).astype(np.int64)
    rows = max(1, BAND_PIXELS // width)
    for first in range(0, height, rows):
        count = min(rows, height - first)
        yield _band(flat, reach, np.maximum(low, first), np.minimum(high, first + count), first, count, width)


def _band(flat: Flat, reach: F32, low: I64, high: I64, first: int, rows: int, width: int) -> _Pairs:
    """The pairs of the rows low to high of each splat; both lie in the band."""
    splat, y = _expanded(low, high)
    a, b, c = flat.conic[splat].T
    centre, dy = flat.centre[splat, 0], flat.centre[splat, 1] - y.astype(np.float32)
    middle = centre + b * dy / a
    half = np.sqrt(np.maximum((reach[splat] - (c - b * b / a) * dy * dy) / a, 0))
    left = np.clip(np.ceil(middle - half), 0, width).astype(np.int64)
    right = np.clip(np.floor(middle + half) + 1, 0, width).astype(np.int64)
    span = np.maximum(right - left, 0)
    ends = np.cumsum(span)
    step = np.arange(int(ends[-1]) if len(ends) else 0, dtype=np.int32)
    dx = np.repeat(centre - (left - ends + span).astype(np.float32), span) - step.astype(np.float32)
    exponent = np.repeat(-b * dy, span) - np.repeat(np.float32(0.5) * a, span) * dx
    exponent *= dx
    exponent += np.repeat(np.log(flat.opacity[splat]) - np.float32(0.5) * c * dy * dy, span)
    pixel = (np.repeat(((y - first) * width + left - ends + span).astype(np.int32), span) + step).astype(
        np.uint16
    )
    order = np.argsort(pixel, kind="stable")
    pixel = pixel[order]
    alpha = np.minimum(np.exp(exponent), ALPHA_MAX)[order]
    counts = np.bincount(pixel, minlength=rows * width)
    filled = np.flatnonzero(counts)
    start = (np.cumsum(counts) - counts)[filled]
    passed = np.log1p(-alpha).astype(np.float64)
    through = np.cumsum(passed) - passed
    if len(start):
        through -= np.repeat(through[start], counts[filled])
    before = np.exp(through.astype(np.float32))
    lit = np.flatnonzero(before > LEAST_TRANSMITTANCE)
    order, pixel, alpha, before = order[lit], pixel[lit], alpha[lit], before[lit]
    counts = np.bincount(pixel, minlength=rows * width)[filled]
    start = np.cumsum(counts) - counts
    splats = np.repeat(splat.astype(np.int32), span)[order]
    return _Pairs(first, rows, splats, pixel, start, filled, alpha, before)


def _expanded(low: I64, high: I64) -> tuple[I64, I64]:
    """(owner, value): every whole number of low[i] to high[i] - 1, for each i in order."""
    count = np.maximum(high - low, 0)
    owner = np.repeat(np.arange(len(low)), count)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(count) - count - low, count)
