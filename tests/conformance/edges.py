"""Gaussians at the thresholds of projection and raster, before a camera at (0, 0, 1) that looks along -z."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from avatar_runtime.avatar import Gaussians
from tests.avatars import Array

SH_C0 = 0.28209479177387814
Row = tuple[Array, Array, Array, float, Array]  # mean, sigma, quat_wxyz, opacity logit, display rgb


def edge_gaussians() -> Gaussians:
    """Some 200, shuffled so that ids say nothing about depth; SH of degree 3."""
    rng = np.random.default_rng(21)
    rows = [row for kind in KINDS for row in kind(rng)]
    rows = [rows[i] for i in rng.permutation(len(rows))]
    mean, sigma, quat, logit, rgb = (np.array(column, np.float32) for column in zip(*rows, strict=True))
    sh = 0.05 * rng.standard_normal((len(rows), 16, 3)).astype(np.float32)
    sh[:, 0] = (rgb - 0.5) / SH_C0
    return Gaussians(mean, np.log(sigma), quat, logit, sh)


def at(x: float, y: float, z: float) -> Array:
    """World position of a point of camera space: +x right, +y down, +z forward."""
    return np.array([x, -y, 1 - z])


def _turn(rng: np.random.Generator) -> Array:
    q = rng.standard_normal(4)
    return q / np.linalg.norm(q)


def _round(sigma: float) -> Array:
    return np.full(3, sigma)


def _stacks(rng: np.random.Generator) -> Iterator[Row]:
    """Opacities next to 1, many bright splats behind: without the clamp to 0.99 nothing shines through."""
    for x, y in ((0.0, 0.0), (-0.35, 0.25), (0.4, -0.3)):
        for k in range(16):
            z = 0.7 + 0.05 * k + 0.01 * rng.uniform()
            colour = np.array([3.0, 0.2, 1.5]) if k % 2 else np.array([0.1, 1.2, 0.3])
            jitter = rng.normal(0, 0.004, 2)
            yield at(x * z + jitter[0], y * z + jitter[1], z), _round(0.05), _turn(rng), 8.0, colour


def _crowd(rng: np.random.Generator) -> Iterator[Row]:
    """Over the whole of a wide image, where order by distance is not order by z."""
    for _ in range(72):
        z = rng.uniform(0.8, 1.6)
        x, y = rng.uniform(-0.9, 0.9) * z, rng.uniform(-0.7, 0.7) * z
        sigma = np.exp(rng.uniform(np.log(0.02), np.log(0.09), 3))
        yield at(x, y, z), sigma, _turn(rng), rng.normal(1, 2), rng.uniform(0, 1, 3)


def _thin(rng: np.random.Generator) -> Iterator[Row]:
    """Thinner than a pixel, round or as needles: the low-pass is all there is of them."""
    for k in range(24):
        z = rng.uniform(0.8, 1.2)
        where = at(rng.uniform(-0.8, 0.8) * z, rng.uniform(-0.6, 0.6) * z, z)
        sigma = _round(0.003) if k % 2 else np.array([0.12, 0.003, 0.003])
        yield where, sigma, _turn(rng), 3.0, rng.uniform(0, 1, 3)


def _ties(rng: np.random.Generator) -> Iterator[Row]:
    """Twins at one place: equal in depth to the bit, told apart by id alone."""
    for _ in range(8):
        where = at(rng.uniform(-0.5, 0.5), rng.uniform(-0.4, 0.4), 0.9)
        for _ in range(2):
            yield where, _round(0.04), _turn(rng), 1.5, rng.uniform(0, 1, 3)


def _near(rng: np.random.Generator) -> Iterator[Row]:
    """On both sides of the near plane (0.05), and behind the camera."""
    for z in (0.03, 0.045, 0.055, 0.07, -0.5, -0.05):
        yield at(0.3 * z, -0.2 * z, z), _round(0.004), _turn(rng), 0.5, rng.uniform(0, 1, 3)


def _outside(rng: np.random.Generator) -> Iterator[Row]:
    """Centres beyond the image and beyond 1.3 times its angle: some reach in, some are culled."""
    for x, y in ((1.05, 0.1), (-1.4, 0.3), (0.2, 1.0), (-0.1, -1.2), (1.6, 1.2), (4.0, 0.0), (0.0, -4.0)):
        yield at(x, y, 1.0), np.array([0.3, 0.2, 0.25]), _turn(rng), 0.0, rng.uniform(0, 1, 3)


def _faint(rng: np.random.Generator) -> Iterator[Row]:
    """Opacity on both sides of 1/255."""
    for k in range(12):
        where = at(rng.uniform(-0.6, 0.6), rng.uniform(-0.4, 0.4), rng.uniform(0.7, 1.0))
        yield where, _round(0.08), _turn(rng), -5.2 - 0.06 * k, np.array([2.0, 2.0, 2.0])


def _odd(rng: np.random.Generator) -> Iterator[Row]:
    """Quaternions that are not unit, one of no length; colours out of 0..1; a splat behind all, one that overflows."""
    yield at(0.1, 0.4, 0.9), np.array([0.1, 0.03, 0.05]), np.zeros(4), 1.0, np.array([0.9, 0.5, 0.1])
    for length in (0.01, 0.5, 3.0):
        where = at(rng.uniform(-0.5, 0.5), rng.uniform(-0.4, 0.4), 1.0)
        yield where, np.array([0.09, 0.02, 0.04]), length * _turn(rng), 1.0, rng.uniform(0, 1, 3)
    yield at(-0.2, 0.3, 0.8), _round(0.05), _turn(rng), 2.0, np.array([-0.7, 0.4, -0.2])
    yield at(0.25, 0.3, 0.8), _round(0.05), _turn(rng), 2.0, np.array([4.0, 0.4, 6.0])
    yield at(0.0, 0.0, 3.0), _round(2.0), _turn(rng), -1.0, np.array([0.2, 0.3, 0.6])
    yield at(0.0, 0.0, 2.0), np.exp([20.0, 19.0, 18.0]), _turn(rng), 2.0, np.array([1.0, 0.0, 1.0])


KINDS = (_stacks, _crowd, _thin, _ties, _near, _outside, _faint, _odd)
