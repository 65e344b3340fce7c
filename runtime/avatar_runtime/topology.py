"""The triangles around each vertex, and a hash of a mesh's connectivity."""

from __future__ import annotations

import hashlib

import numpy as np

from avatar_runtime.avatar import I64, U32


def topology_hash(triangles: U32, vertices: int) -> str:
    """sha256, in hex, of the vertex count and then the triangles' corners [F, 3], all as little-endian uint32.

    Equal for two meshes only if they number the same vertices in the same triangles in the same order.
    """
    count = np.array([vertices], "<u4").tobytes()
    return hashlib.sha256(count + np.ascontiguousarray(triangles, "<u4").tobytes()).hexdigest()


def vertex_triangles(triangles: U32, vertices: int) -> tuple[U32, U32]:
    """(vertex_triangle_ptr [V + 1], vertex_triangle [3 F]): the triangles of vertex v, in rising order, are
    vertex_triangle[vertex_triangle_ptr[v] : vertex_triangle_ptr[v + 1]]; a corner repeated in one triangle
    counts as often.
    """
    corner: I64 = triangles.reshape(-1).astype(np.int64)
    order = np.argsort(corner, kind="stable")
    ptr = np.concatenate([[0], np.cumsum(np.bincount(corner, minlength=vertices))])
    return ptr.astype(np.uint32), (order // 3).astype(np.uint32)
