"""Where points of the unwrapped plane lie on a template's mesh."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F64, I64, U32

POINTS = 16  # located at once: [POINTS, F] arrays at a time


def locate(points: F64, uv: F64, triangles: U32) -> tuple[I64, F64]:
    """(triangle [P], barycentric [P, 3]) of `points` [P, 2] in the plane of `uv` [V, 2].

    The triangle that holds the point, else the nearest one and the weights of its nearest point (Eq. 8 to 10 know
    points inside alone; where an optimiser leads a bone off the chart, its nearest place is the continuous answer).
    Of several as near, the first in the file. Triangles without area in the plane are lines or points.
    """
    corner = uv.astype(np.float64)[triangles]  # [F, 3, 2]
    triangle, weights = np.zeros(len(points), np.int64), np.zeros((len(points), 3))
    for first in range(0, len(points), POINTS):
        part = slice(first, first + POINTS)
        triangle[part], weights[part] = _nearest(points[part].astype(np.float64), corner)
    return triangle, weights


def _nearest(points: F64, corner: F64) -> tuple[I64, F64]:
    a, b, c = np.moveaxis(corner, 1, 0)
    inner = _barycentric(points, a, b, c)  # [p, F, 3]
    inside = (inner >= 0).all(axis=-1)
    squared = np.where(inside, 0.0, np.inf)
    best = inner
    for first, second in ((0, 1), (1, 2), (2, 0)):
        along, distance = _on_edge(points, corner[:, first], corner[:, second])
        nearer = distance < squared
        edge = np.zeros_like(inner)
        edge[..., first], edge[..., second] = 1 - along, along
        best = np.where(nearer[..., None], edge, best)
        squared = np.where(nearer, distance, squared)
    triangle = np.argmin(squared, axis=1).astype(np.int64)
    return triangle, np.take_along_axis(best, triangle[:, None, None], axis=1)[:, 0]


def _barycentric(points: F64, a: F64, b: F64, c: F64) -> F64:
    """Eq. 10 [p, F, 3] of points [p, 2] in triangles [F, 2]; -1 where a triangle has no area."""
    p = points[:, None]
    area = _cross(b - a, c - a)
    flat = area == 0
    safe = np.where(flat, 1.0, area)
    alpha, beta = _cross(b - p, c - p) / safe, _cross(c - p, a - p) / safe
    result: F64 = np.stack([alpha, beta, 1 - alpha - beta], axis=-1)
    result[:, flat] = -1
    return result


def _on_edge(points: F64, start: F64, end: F64) -> tuple[F64, F64]:
    """(where along each edge [p, F] its point nearest to each point lies, 0..1; the squared distance [p, F])."""
    edge, offset = end - start, points[:, None] - start
    squared = np.sum(edge * edge, axis=-1)
    along = np.clip(np.sum(offset * edge, axis=-1) / np.where(squared > 0, squared, 1.0), 0, 1)
    away = offset - along[..., None] * edge
    return along, np.sum(away * away, axis=-1)


def _cross(a: F64, b: F64) -> F64:
    result: F64 = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return result
