"""A triangle mesh, and small functions on its geometry."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh in metres, +Y up, +Z out of the face, +X towards the subject's left."""

    vertices: Array  # f64 [V, 3]
    triangles: Array  # i64 [F, 3], counter-clockwise from the visible side

    @cached_property
    def vertex_normals(self) -> Array:
        """Area-weighted unit normals [V, 3]."""
        corner = self.vertices[self.triangles]
        area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        normal = np.zeros_like(self.vertices)
        for i in range(3):
            np.add.at(normal, self.triangles[:, i], area)
        return unit(normal)


def unit(x: Array) -> Array:
    """Rows of x, divided by their length."""
    result: Array = x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-12)
    return result


def smoothstep(x: Array, start: float, end: float) -> Array:
    """0 before start, 1 after end, smooth between; start may be larger than end."""
    t = np.clip((x - start) / (end - start), 0, 1)
    result: Array = t * t * (3 - 2 * t)
    return result
