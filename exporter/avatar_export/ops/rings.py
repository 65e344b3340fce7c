"""The triangles around each triangle of a mesh."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import I64, U32
from avatar_runtime.topology import vertex_triangles

RING = 25  # triangles about a triangle, itself included


def rings(triangles: U32, vertices: int) -> I64:
    """[T, RING] triangles that share a vertex with each triangle, itself first; repeated where there are fewer."""
    pointer, member = (part.astype(np.int64) for part in vertex_triangles(triangles, vertices))
    corners = triangles.astype(np.int64)
    own = np.arange(len(corners))[:, None]
    around = [own]
    for k in range((RING - 1) // 3):
        at = pointer[corners] + k
        around.append(np.where(at < pointer[corners + 1], member[np.minimum(at, len(member) - 1)], own))
    return np.concatenate(around, axis=1)
