"""Spherical harmonics of a Gaussian that turns with its triangle (rule init_sh = rotated)."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F64
from avatar_runtime.stages import project

DIRECTIONS = 64  # enough and even enough for the 16 functions of degree 3


def turn_matrices(rotation: Tensor, degree: int) -> Tensor:
    """D [E, K, K] with sum_j Y_j(d) (D sh)_j = sum_j Y_j(R^T d) sh_j, for rotations R [E, 3, 3]; K = (degree + 1)^2.

    A rotation maps the functions of a degree to each other, so D follows from their values in enough directions.
    """
    directions = _sphere(DIRECTIONS)
    inverse = np.linalg.pinv(_basis(directions, degree))  # [K, D]
    turned = np.einsum("dj,eji->edi", directions, rotation.numpy().astype(np.float64))  # R^T d
    values = _basis(turned.reshape(-1, 3), degree).reshape(len(turned), DIRECTIONS, -1)
    result = np.einsum("kd,edj->ekj", inverse, values)
    return torch.from_numpy(result.astype(np.float32))


def _basis(direction: F64, degree: int) -> F64:
    """Y_k(d), [D, K]."""
    count = (degree + 1) ** 2
    unit = np.broadcast_to(np.eye(count), (len(direction), count, count))
    # The stage is declared for float32. Here it computes in float64: the pseudo-inverse magnifies rounding.
    result: F64 = project.sh_colour(unit, direction, degree).astype(np.float64) - 0.5  # type: ignore[arg-type]
    return result


def _sphere(count: int) -> F64:
    """Even unit directions [count, 3] (a Fibonacci spiral)."""
    row = np.arange(count)
    z = 1 - (2 * row + 1) / count
    angle = row * np.pi * (3 - np.sqrt(5))
    flat = np.sqrt(1 - z * z)
    result: F64 = np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)
    return result
