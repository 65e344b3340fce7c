"""The nearest point of a triangle mesh, with NumPy alone.

All pairs are only bounded: a triangle lies within its radius of its centroid, and the nearest triangle is no farther
than the nearest centroid. What these bounds leave, some ten triangles a point, is computed exactly (Ericson 2005).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I64, U32

ENTRIES = 1 << 21  # of point and triangle, bounded at a time
FARTHEST = 1e9  # sizes of the mesh; points beyond are taken to be there
ROUNDING = 8 * float(np.finfo(np.float32).eps)  # of a squared distance by the matrix product, of |p|^2 + R^2


@dataclass(frozen=True)
class Nearest:
    """The nearest points of a mesh to N points."""

    triangle: I64  # [N] row of the triangles
    barycentric: F64  # [N, 3]
    distance: F64  # [N] in the unit of the mesh


def nearest_on_mesh(points: F64, vertices: F64, triangles: U32) -> Nearest:
    """The nearest point on `triangles` [F, 3] of `vertices` [V, 3] to each of `points` [N, 3]; F > 0.

    Triangles without area count as segments. Of equally near triangles the first is named.
    """
    corner = vertices.astype(np.float64)[triangles.astype(np.int64)]  # [F, 3, 3]
    middle = corner.mean(axis=(0, 1))
    corner = corner - middle
    unit = float(np.abs(corner).max()) or 1.0  # of the lengths below, so that their squares stay in range
    corner, points = (
        corner / unit,
        np.clip((np.asarray(points, np.float64) - middle) / unit, -FARTHEST, FARTHEST),
    )
    centroid = corner.mean(axis=1)
    radius = np.linalg.norm(corner - centroid[:, None], axis=2).max(axis=1)
    parts = [
        _nearest(points[start : start + step], corner, centroid.astype(np.float32), radius.astype(np.float32))
        for step in [max(1, ENTRIES // len(corner))]
        for start in range(0, len(points), step)
    ]
    none = (np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0))
    triangle, weights, distance = (np.concatenate(column) for column in zip(none, *parts, strict=True))
    return Nearest(triangle, weights, unit * distance)


def _nearest(points: F64, corner: F64, centroid: F32, radius: F32) -> tuple[I64, F64, F64]:
    p, one = points.astype(np.float32), np.ones((len(points), 1), np.float32)
    reach = np.einsum("ij,ij->i", centroid, centroid)
    own = np.einsum("ij,ij->i", p, p)
    error = np.float32(ROUNDING) * (own + reach.max())
    square = np.hstack([-2 * p, one]) @ np.vstack([centroid.T, reach])  # less |p|^2
    bound = np.sqrt(np.maximum(square.min(axis=1) + own, 0) + error)  # the nearest triangle is no farther
    # square + |p|^2 <= (bound + radius)^2 + error, without a second matrix of squares
    limit = np.hstack([(bound**2 + error - own)[:, None], 2 * bound[:, None], one])
    square -= limit @ np.vstack([np.ones_like(radius), radius, radius**2])
    row, candidate = np.divmod(np.flatnonzero(square <= error[:, None]), len(corner))
    weights, distance = _on_triangle(points[row], corner[candidate])
    least = np.minimum.reduceat(distance, np.searchsorted(row, np.arange(len(points))))
    best = np.flatnonzero(distance == least[row])
    best = best[np.unique(row[best], return_index=True)[1]]
    return candidate[best].astype(np.int64), weights[best], np.sqrt(distance[best])


def _on_triangle(point: F64, corner: F64) -> tuple[F64, F64]:
    """(barycentric [M, 3], squared distance [M]) of the nearest point of each triangle `corner` [M, 3, 3]."""
    edge, across = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    to = point - corner[:, 0]
    ee, ea, aa = (np.einsum("ij,ij->i", a, b) for a, b in ((edge, edge), (edge, across), (across, across)))
    te, ta = np.einsum("ij,ij->i", to, edge), np.einsum("ij,ij->i", to, across)
    area = ee * aa - ea * ea
    with np.errstate(divide="ignore", invalid="ignore"):  # no area: NaN, which lies nowhere inside
        v, w = (aa * te - ea * ta) / area, (ee * ta - ea * te) / area
        inside = (v >= 0) & (w >= 0) & (v + w <= 1)
        weights = np.stack([1 - v - w, v, w], axis=1)
    square = np.where(inside, _square(point, corner, weights, inside), np.inf)
    outside = np.flatnonzero(~inside)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        start, along = corner[outside, a], corner[outside, b] - corner[outside, a]
        length = np.einsum("ij,ij->i", along, along)
        t = np.einsum("ij,ij->i", point[outside] - start, along) / np.maximum(length, 1e-300)
        t = np.clip(t, 0, 1)
        off = point[outside] - start - t[:, None] * along
        found = np.einsum("ij,ij->i", off, off)
        nearer = found < square[outside]
        rows = outside[nearer]
        square[rows] = found[nearer]
        weights[rows] = 0
        weights[rows, a], weights[rows, b] = 1 - t[nearer], t[nearer]
    return weights, square


def _square(point: F64, corner: F64, weights: F64, rows: npt.NDArray[np.bool_]) -> F64:
    result: F64 = np.zeros(len(point))
    off = point[rows] - np.einsum("ij,ijk->ik", weights[rows], corner[rows])
    result[rows] = np.einsum("ij,ij->i", off, off)
    return result
