"""Vectors at the vertices of a mesh, smoothed over its edges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import prange

from avatar_runtime import F32, I64, U32
from avatar_runtime.backends.cpu import kernel


class Edges(NamedTuple):
    """The vertices that share an edge with each of V vertices."""

    ptr: I64  # [V + 1]
    other: I64  # [E]


def edges_of(triangles: U32, vertices: int) -> Edges:
    """The edges of `triangles` [F, 3], in both directions."""
    t = triangles.astype(np.int64)
    directed = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    pairs = np.unique(np.concatenate([directed, directed[:, ::-1]]), axis=0)
    degree = np.bincount(pairs[:, 0], minlength=vertices)
    return Edges(np.concatenate([[0], np.cumsum(degree)]), np.ascontiguousarray(pairs[:, 1]))


@kernel(parallel=True)
def smoothed(vectors: F32, edges: Edges, share: float, out: F32) -> None:
    """out [U, V, 3]: each of `vectors` moved by `share` to the mean of its neighbours; one without any stays."""
    count, vertices, _ = vectors.shape
    for u in prange(count):
        for v in range(vertices):
            first, end = edges.ptr[v], edges.ptr[v + 1]
            for k in range(3):
                total = 0.0
                for e in range(first, end):
                    total += vectors[u, edges.other[e], k]
                own = vectors[u, v, k]
                out[u, v, k] = own + share * (total / (end - first) - own) if end > first else own
