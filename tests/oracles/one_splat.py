"""One Gaussian seen by a pinhole camera, from the textbook; float64.

Its mean goes through K [R | t], its covariance through the Jacobian of that map, and 0.3 square pixels are added;
alpha is its opacity times the density relative to the peak, colour is what its spherical harmonics say along the
ray.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tests.oracles.rotation_sh import evaluate

Array = npt.NDArray[Any]


def pixel(
    mean: Array,  # [3] world
    scale: Array,  # [3]
    quat_wxyz: Array,  # [4] of unit length
    opacity: float,
    sh: Array,  # [K, 3]
    degree: int,
    rotation: Array,  # [3, 3] camera from world
    translation: Array,  # [3]
    intrinsics: Array,  # [3, 3] pixel centres at half integers
    background: Array,  # [3]
    column: int,
    row: int,
) -> tuple[Array, float]:
    """(colour [3] over the background, alpha) of one pixel."""
    x, y, z = seen = rotation @ mean + translation
    place = intrinsics @ seen
    focal_x, focal_y = intrinsics[0, 0], intrinsics[1, 1]
    jacobian = np.array([[focal_x / z, 0, -focal_x * x / z**2], [0, focal_y / z, -focal_y * y / z**2]])
    axes = jacobian @ rotation @ turn(quat_wxyz) @ np.diag(scale)
    covariance = axes @ axes.T + 0.3 * np.eye(2)
    away = place[:2] / place[2] - (column + 0.5, row + 0.5)
    alpha = opacity * np.exp(-0.5 * away @ np.linalg.solve(covariance, away))
    ray = mean + rotation.T @ translation
    colour = evaluate(sh[None], (ray / np.linalg.norm(ray))[None], degree)[0]
    return alpha * np.maximum(colour, 0) + (1 - alpha) * background, float(alpha)


def turn(q: Array) -> Array:
    """v -> q v q* as a matrix."""
    w, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    matrix: Array = (w * w - v @ v) * np.eye(3) + 2 * np.outer(v, v) + 2 * w * cross
    return matrix
