"""PSAvatar's Gaussians on a mesh, one at a time, float64: Eqs. 8 to 11 of its paper as they stand, R = R^j R'.

The rotation nearest to a sum of matrices comes from its singular values, the local one from axis and angle.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.oracles.lbs import rodrigues

Array = npt.NDArray[Any]


def rotation_of(quaternion: Array) -> Array:
    """Rotation matrix of a quaternion wxyz of any length."""
    w, v = float(quaternion[0]), quaternion[1:].astype(np.float64)
    sine = math.sqrt(float(v @ v))
    return np.eye(3) if sine == 0 else rodrigues(2 * math.atan2(sine, w) * v / sine)


def nearest_rotation(m: Array) -> Array:
    """The orthogonal factor of m = R P."""
    u, _, vt = np.linalg.svd(m)
    return u @ vt


def rotation_under(weights: Array, joints: Array, corners: Array, barycentric: Array) -> Array:
    """R^j [3, 3]: `weights` [V, J] dense, `joints` [J, 4, 4] skin matrices, `corners` three vertices of the mesh."""
    blended = np.zeros((3, 3))
    for vertex, share in zip(corners, barycentric, strict=True):
        for joint, weight in enumerate(weights[vertex]):
            blended += float(share) * float(weight) * joints[joint, :3, :3].astype(np.float64)
    return nearest_rotation(blended)


def normal_at(vertices: Array, triangles: Array, vertex: int, floor: float) -> Array:
    """Sum of edge x edge over the triangles of a vertex, made unit or, below `floor`, divided by it."""
    total = np.zeros(3)
    for triangle in triangles:
        if vertex in triangle:
            a, b, c = (vertices[i].astype(np.float64) for i in triangle)
            total += np.cross(b - a, c - a)
    return total / max(math.sqrt(float(total @ total)), floor)


def point(
    vertices: Array,  # [V, 3] posed
    triangles: Array,
    at: int,
    barycentric: Array,
    height: float,
    floor: float,
) -> Array:
    """p_off = p_on + r n, n the interpolated normal as it is."""
    place = np.zeros(3)
    for vertex, share in zip(triangles[at], barycentric, strict=True):
        normal = normal_at(vertices, triangles, int(vertex), floor)
        place += float(share) * (vertices[vertex].astype(np.float64) + height * normal)
    return place
