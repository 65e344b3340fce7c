"""From points of the unwrapped plane to points on a template's mesh."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F64, I64, U32


def locate(points: F64, uv: F64, triangles: U32) -> tuple[I64, F64]:
    """(triangle [P], barycentric [P, 3]) of `points` [P, 2] in the plane of `uv` [V, 2].

    The triangle that contains the point, else the nearest triangle and the weights of its nearest point. Eq. 8 to 10
    define only points inside; the nearest point is the continuous extension, for an optimiser that moves a bone off the
    chart. Of several equally near triangles the first in the file. Triangles without area count as lines or points.
    """
    corner = uv.astype(np.float64)[triangles]  # [F, 3, 2]
    low, high = corner.min(axis=1), corner.max(axis=1)
    triangle, weights = np.zeros(len(points), np.int64), np.zeros((len(points), 3))
    for row, point in enumerate(points.astype(np.float64)):
        near = _candidates(point, corner, low, high)
        found, weights[row] = _nearest(point, corner[near])
        triangle[row] = near[found]
    return triangle, weights


def _candidates(point: F64, corner: F64, low: F64, high: F64) -> I64:
    """Rows of the triangles whose boxes are not farther than the nearest first corner; they include the nearest."""
    farthest = np.sum((corner[:, 0] - point) ** 2, axis=1).min()
    box = np.sum((point - np.clip(point, low, high)) ** 2, axis=1)
    result: I64 = np.flatnonzero(box <= farthest).astype(np.int64)
    return result


def _nearest(point: F64, corner: F64) -> tuple[int, F64]:
    """(row of the triangle [F, 3, 2], barycentric weights [3] of its nearest point)."""
    best = _barycentric(point, *np.moveaxis(corner, 1, 0))  # [F, 3]
    squared = np.where((best >= 0).all(axis=-1), 0.0, np.inf)
    for first, second in ((0, 1), (1, 2), (2, 0)):
        along, distance = _on_edge(point, corner[:, first], corner[:, second])
        nearer = distance < squared
        edge = np.zeros_like(best)
        edge[:, first], edge[:, second] = 1 - along, along
        best = np.where(nearer[:, None], edge, best)
        squared = np.where(nearer, distance, squared)
    row = int(np.argmin(squared))
    return row, best[row]


def _barycentric(p: F64, a: F64, b: F64, c: F64) -> F64:
    """Eq. 10 [F, 3] of a point [2] in triangles [F, 2]; -1 where a triangle has no area."""
    area = _cross(b - a, c - a)
    safe = np.where(area == 0, 1.0, area)
    alpha, beta = _cross(b - p, c - p) / safe, _cross(c - p, a - p) / safe
    result: F64 = np.stack([alpha, beta, 1 - alpha - beta], axis=-1)
    result[area == 0] = -1
    return result


def _on_edge(point: F64, start: F64, end: F64) -> tuple[F64, F64]:
    """(position 0..1 on each edge [F] of its point nearest to a point; the squared distance [F])."""
    edge, offset = end - start, point - start
    squared = np.sum(edge * edge, axis=-1)
    along = np.clip(np.sum(offset * edge, axis=-1) / np.where(squared > 0, squared, 1.0), 0, 1)
    away = offset - along[:, None] * edge
    return along, np.sum(away * away, axis=-1)


def _cross(a: F64, b: F64) -> F64:
    result: F64 = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result
