"""Walking on triangles: a point of a mesh moves straight on over its edges, from triangle to triangle.

A straight line over an edge is straight in the parallelogram of the two triangles: barycentric weights ignore their
shape. Source: SplattingAvatar (arXiv 2403.05087) Algorithm 1 and Fig. 4. Its released walker (triangle_walk.cpp)
does the same, multiplies the remaining way by 0.9 at every edge, and treats an end up to 1e-3 outside as inside and
moves it in. That slack is left out here: it would hold a point that moves in smaller steps at its edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import prange

from avatar_runtime import F64, I32, I64
from avatar_runtime.backends.cpu import kernel

PAPER_DECAY, RELEASED_DECAY = 1.0, 0.9  # factor of the remaining way at each edge
MOST_CROSSINGS = 10_000  # largest number of edges in one walk; a longer walk ends on the edge it has reached


@dataclass(frozen=True)
class Neighbours:
    """What lies over each edge of a mesh's triangles; edge j runs from corner j to corner j + 1."""

    triangle: I32  # [F, 3] the triangle over edge j, -1 at a border
    edge: I32  # [F, 3] which of its edges that is


@dataclass(frozen=True)
class Walked:
    """The ends of walks."""

    triangle: I64  # [N]
    barycentric: F64  # [N, 3] each 0..1; they add up to 1
    crossings: I32  # [N] edges walked over


def neighbours(triangles: npt.NDArray[Any]) -> Neighbours:
    """The neighbours of `triangles` [F, 3]: over the edge from a to b lies the triangle with an edge from b to a.

    Of several the one with the lowest number; an edge that is only shared with the other winding is a border.
    """
    corner = triangles.astype(np.int64)
    first, second = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1)
    base = int(corner.max(initial=0)) + 1
    key, wanted = first * base + second, second * base + first
    order = np.argsort(key, kind="stable")
    at = np.minimum(np.searchsorted(key, wanted, sorter=order), len(order) - 1)
    over = order[at]  # 3 * triangle + edge
    found = key[over] == wanted
    return Neighbours(
        np.where(found, over // 3, -1).astype(np.int32).reshape(-1, 3),
        np.where(found, over % 3, -1).astype(np.int32).reshape(-1, 3),
    )


def walk(
    mesh: Neighbours,
    triangle: npt.NDArray[Any],
    barycentric: npt.NDArray[Any],
    delta_uv: npt.NDArray[Any],
    decay: float = PAPER_DECAY,
) -> Walked:
    """Move the points of `triangle` [N] at `barycentric` [N, 3] by `delta_uv` [N, 2].

    `delta_uv` is the change of the weights of corners 0 and 1; that of corner 2 follows. At each edge what remains
    is multiplied by `decay`; at a border the walk ends on it. A start outside its triangle is moved in first
    (negative weights become 0). A change that is not finite moves nothing. Raises ValueError for shapes and
    triangles that do not go together.
    """
    n = len(triangle)
    if barycentric.shape != (n, 3) or delta_uv.shape != (n, 2):
        raise ValueError(f"{n} points have weights {barycentric.shape} and changes {delta_uv.shape}")
    if n and not 0 <= triangle.min() <= triangle.max() < len(mesh.triangle):
        raise ValueError(f"triangles are not all among 0..{len(mesh.triangle) - 1}")
    rows, weights = triangle.astype(np.int64), barycentric.astype(np.float64)
    u, v = delta_uv.astype(np.float64).T
    shift = np.stack([u, v, -(u + v)], axis=1)
    crossings = np.zeros(n, np.int32)
    _walk_all(mesh.triangle, mesh.edge, rows, weights, shift, float(decay), crossings)
    return Walked(rows, weights, crossings)


@kernel(parallel=True)
def _walk_all(
    over: I32, over_edge: I32, rows: I64, weights: F64, shift: F64, decay: float, crossings: I32
) -> None:
    for i in prange(len(rows)):
        rows[i], crossings[i] = walk_one(over, over_edge, rows[i], weights[i], shift[i], decay)


@kernel()
def walk_one(over: I32, over_edge: I32, triangle: int, b: F64, s: F64, decay: float) -> Any:
    """One walk: (triangle, crossings). Weights `b` [3] and shift `s` [3] are changed in place."""
    _move_in(b)
    if not (np.isfinite(s[0]) and np.isfinite(s[1]) and np.isfinite(s[2])):
        return triangle, 0
    crossings = 0
    while True:
        corner, share = _way_out(b, s)
        for j in range(3):
            b[j] += share * s[j]
        if corner < 0:
            break
        b[corner] = 0.0
        edge = (corner + 1) % 3  # opposite the corner whose weight is gone
        if over[triangle, edge] < 0 or crossings == MOST_CROSSINGS:
            break
        _re_express(b, s, edge, over_edge[triangle, edge], (1 - share) * decay)
        triangle = over[triangle, edge]
        crossings += 1
    _move_in(b)
    return triangle, crossings


@kernel()
def _way_out(b: F64, s: F64) -> Any:
    """(corner whose weight is gone first on the way from b to b + s, share of the way until then), or (-1, 1)."""
    corner, share = -1, 1.0
    for j in range(3):
        end = b[j] + s[j]
        if end < 0 and b[j] / (b[j] - end) < share:
            corner, share = j, b[j] / (b[j] - end)
    return corner, share


@kernel()
def _re_express(b: F64, s: F64, edge: int, entered: int, left: float) -> None:
    """Weights and shift, of which `left` remains, of a point on `edge` in the triangle that it enters over `entered`.

    The new corner D lies opposite C in the parallelogram over the edge from A to B: C = A + B - D.
    """
    b_a, b_b = b[edge], b[(edge + 1) % 3]
    s_a, s_b = left * s[edge], left * s[(edge + 1) % 3]
    b[entered], b[(entered + 1) % 3], b[(entered + 2) % 3] = b_b, b_a, 0.0
    s[entered], s[(entered + 1) % 3], s[(entered + 2) % 3] = -s_a, -s_b, s_a + s_b


@kernel()
def _move_in(b: F64) -> None:
    """Negative weights become 0, the sum 1."""
    total = max(b[0], 0.0) + max(b[1], 0.0) + max(b[2], 0.0)
    for j in range(3):
        b[j] = max(b[j], 0.0) / total
