"""Normals of triangle meshes whose stages do not need them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_runtime import F64


def vertex_normals(vertices: F64, triangles: npt.NDArray[np.integer]) -> F64:
    """[V, 3] unit normals, triangles weighted by area; 0 for a vertex without a triangle."""
    corner = vertices[triangles]
    area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    total = np.stack(
        [
            sum(np.bincount(triangles[:, k], area[:, axis], len(vertices)) for k in range(3))
            for axis in range(3)
        ],
        axis=1,
    )
    unit: F64 = total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
    return unit
