"""One Gaussian seen by a pinhole camera, from the textbook; float64.

Its mean goes through K [R | t], its covariance through the Jacobian of that map, and 0.3 square pixels are added;
alpha is its opacity times the density relative to the peak, colour is what its spherical harmonics say along the ray.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from tests.oracles.joint_turns import rotation_of
from tests.oracles.rotation_sh import evaluate

Array = npt.NDArray[Any]


def pixel(splat: dict[str, Array], degree: int, view: Array, k: Array, background: Array, at: Array) -> Array:
    """Red, green, blue over the background and alpha at the image's point `at`; view [4, 4] is camera from world."""
    rotation, translation = view[:3, :3], view[:3, 3]
    x, y, z = seen = rotation @ splat["mean"] + translation
    place = k @ seen
    jacobian = np.array([[k[0, 0] / z, 0, -k[0, 0] * x / z**2], [0, k[1, 1] / z, -k[1, 1] * y / z**2]])
    axes = jacobian @ rotation @ rotation_of(splat["quat_wxyz"]) @ np.diag(splat["scale"])
    away = place[:2] / place[2] - at
    covariance = axes @ axes.T + 0.3 * np.eye(2)
    alpha = splat["opacity"] * np.exp(-0.5 * away @ np.linalg.solve(covariance, away))
    ray = splat["mean"] + rotation.T @ translation
    colour = evaluate(splat["sh"][None], (ray / np.linalg.norm(ray))[None], degree)[0]
    return np.append(alpha * np.maximum(colour, 0) + (1 - alpha) * background, alpha)
