"""Real spherical harmonics from their definition, and their rotation by quadrature; float64.

Y_l^m = N_l^|m| P_l^|m|(z) cos(m phi) or sin(|m| phi), times sqrt 2 for m != 0, with the Condon-Shortley phase
(-1)^m in P; coefficient l^2 + l + m. No formula in x, y, z is shared with the runtime.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def basis(direction: Array, degree: int) -> Array:
    """Y_k(direction), [N, (degree + 1)^2]; direction [N, 3] of unit length."""
    x, y, z = np.asarray(direction, np.float64).T
    phi = np.arctan2(y, x)
    columns = []
    for l in range(degree + 1):  # noqa: E741 (the degree's name everywhere)
        for m in range(-l, l + 1):
            order = abs(m)
            norm = math.sqrt(
                (2 * l + 1) / (4 * math.pi) * math.factorial(l - order) / math.factorial(l + order)
            )
            angular = np.cos(m * phi) if m >= 0 else np.sin(order * phi)
            columns.append(norm * (math.sqrt(2) if m else 1.0) * legendre(l, order, z) * angular)
    return np.stack(columns, axis=1)


def legendre(l: int, m: int, z: Array) -> Array:  # noqa: E741
    """Associated Legendre P_l^m(z) by (l - m) P_l = (2 l - 1) z P_{l-1} - (l + m - 1) P_{l-2}."""
    value = (-1.0) ** m * math.prod(range(1, 2 * m, 2)) * (1 - z * z) ** (m / 2)
    before = np.zeros_like(z)
    for k in range(m + 1, l + 1):
        before, value = value, ((2 * k - 1) * z * value - (k + m - 1) * before) / (k - m)
    return value


def evaluate(sh: Array, direction: Array, degree: int) -> Array:
    """sum_k Y_k(direction) sh_k + 0.5, [N, 3]; sh [N, K, 3], K may exceed the degree's."""
    y = basis(direction, degree)
    return np.einsum("nk,nkc->nc", y, np.asarray(sh, np.float64)[:, : y.shape[1]]) + 0.5


def rotate(sh: Array, rotation: Array, degree: int) -> Array:
    """SH [N, K, 3] of f'(d) = f(R^T d), for R [N, 3, 3]; each coefficient is an integral over the sphere.

    Gauss-Legendre in z times a uniform ring in phi is exact for the products of two basis functions.
    """
    nodes, weights = np.polynomial.legendre.leggauss(2 * degree + 2)
    ring = np.arange(4 * degree + 4) * (2 * np.pi / (4 * degree + 4))
    z, phi = (grid.ravel() for grid in np.meshgrid(nodes, ring, indexing="ij"))
    weight = np.repeat(weights, len(ring)) * (2 * np.pi / len(ring))
    flat = np.sqrt(1 - z * z)
    d = np.stack([flat * np.cos(phi), flat * np.sin(phi), z], axis=1)
    projector = basis(d, degree) * weight[:, None]
    out = np.empty((len(sh), projector.shape[1], 3))
    for n, (coefficients, r) in enumerate(zip(sh, rotation, strict=True)):
        seen = basis(d @ np.asarray(r, np.float64), degree)  # rows d^T R = (R^T d)^T
        out[n] = projector.T @ (seen @ np.asarray(coefficients, np.float64)[: projector.shape[1]])
    return out
