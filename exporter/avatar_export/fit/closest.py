"""The nearest point of a triangle mesh, with NumPy alone.

Triangles are gathered in blocks of neighbours. A block lies within its radius of its centre, a triangle within its
radius of its centroid; what these bounds leave, some ten triangles a point, is computed exactly (Ericson 2005).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F64, I64, U32

ENTRIES = 1 << 21  # of point and triangle, looked at together at most
FARTHEST = 1e9  # sizes of the mesh; points beyond are taken to be there
BLOCK = 16  # triangles
CELLS = 1 << 10  # along an axis, in whose order triangles are gathered
ROUNDING = 16 * float(np.finfo(np.float64).eps)  # of a distance between a point and a mesh of size 1 about 0


@dataclass(frozen=True)
class Nearest:
    """The nearest points of a mesh to N points."""

    triangle: I64  # [N] row of the triangles
    barycentric: F64  # [N, 3]
    distance: F64  # [N] in the unit of the mesh


@dataclass(frozen=True)
class Triangles:
    """A mesh about 0, of size 1, whose triangles are gathered by neighbourhood, and balls about them."""

    middle: F64  # [3] what was 0 before
    unit: float  # a length of 1, before
    corner: F64  # [F, 3, 3]
    centroid: F64  # [F, 3]
    reach: F64  # [F] of the ball about the centroid that holds the triangle
    member: I64  # [B, BLOCK] rows of the triangles; the last block repeats its last one
    inside: F64  # [B, 3] a point of the mesh about the middle of the block
    centre: F64  # [B, 3]
    radius: F64  # [B] of the ball that holds the block

    @staticmethod
    def of(vertices: F64, triangles: U32) -> Triangles:
        """`triangles` [F, 3] of `vertices` [V, 3]; F > 0."""
        corner = vertices.astype(np.float64)[triangles.astype(np.int64)]  # [F, 3, 3]
        middle = corner.mean(axis=(0, 1))
        corner = corner - middle
        unit = float(np.abs(corner).max()) or 1.0  # so that squares of lengths stay in range
        corner = corner / unit
        centroid = corner.mean(axis=1)
        reach = np.sqrt(np.square(corner - centroid[:, None]).sum(axis=2).max(axis=1))
        member = _neighbours(centroid)
        centre = centroid[member].mean(axis=1)
        off = np.square(centroid[member] - centre[:, None]).sum(axis=2)
        inside = centroid[member[np.arange(len(member)), off.argmin(axis=1)]]
        radius = (np.sqrt(off) + reach[member]).max(axis=1)
        return Triangles(middle, unit, corner, centroid, reach, member, inside, centre, radius)

    def nearest(self, points: F64) -> Nearest:
        """The nearest point of the mesh to each of `points` [N, 3].

        Triangles without area count as segments. Of equally near triangles the first is named.
        """
        points = np.clip((np.asarray(points, np.float64) - self.middle) / self.unit, -FARTHEST, FARTHEST)
        step = max(1, ENTRIES // len(self.corner))
        parts = [_nearest(points[start : start + step], self) for start in range(0, len(points), step)]
        none = (np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0))
        triangle, weights, distance = (np.concatenate(column) for column in zip(none, *parts, strict=True))
        return Nearest(triangle, weights, self.unit * distance)


def _neighbours(centroid: F64) -> I64:
    """[B, BLOCK] rows of `centroid` [F, 3], in -1 to 1, of which those of a line lie near each other."""
    cell = ((centroid + 1) * (0.5 * (CELLS - 1))).astype(np.int64)
    code = sum(_spread(cell[:, axis]) << axis for axis in range(3))
    order = np.argsort(code, kind="stable")
    return np.pad(order, (0, -len(order) % BLOCK), mode="edge").reshape(-1, BLOCK)


def _spread(value: I64) -> I64:
    """The ten bits of each value, three places apart."""
    found = np.zeros_like(value)
    for bit in range(10):
        found |= (value >> bit & 1) << 3 * bit
    return found


def _nearest(points: F64, mesh: Triangles) -> tuple[I64, F64, F64]:
    slack = ROUNDING * (1 + np.abs(points).max(axis=1, initial=0))
    bound = _apart(points, mesh.inside).min(axis=1) + slack  # the nearest triangle is no farther
    row, block = np.nonzero(_apart(points, mesh.centre) - mesh.radius <= bound[:, None])
    row, candidate = np.repeat(row, BLOCK), mesh.member[block].ravel()
    off = points[row] - mesh.centroid[candidate]
    away = np.sqrt(np.einsum("ij,ij->i", off, off))
    bound = np.minimum.reduceat(away, np.searchsorted(row, np.arange(len(points)))) + slack
    left = np.flatnonzero(away - mesh.reach[candidate] <= bound[row])
    left = left[np.lexsort((candidate[left], row[left]))]
    row, candidate = row[left], candidate[left]
    weights, distance = _on_triangle(points[row], mesh.corner[candidate])
    least = np.minimum.reduceat(distance, np.searchsorted(row, np.arange(len(points))))
    best = np.flatnonzero(distance == least[row])
    best = best[np.unique(row[best], return_index=True)[1]]
    return candidate[best], weights[best], np.sqrt(distance[best])


def _apart(points: F64, others: F64) -> F64:
    """[N, M] distances."""
    square = np.zeros((len(points), len(others)))
    for axis in range(3):
        square += np.square(points[:, axis, None] - others[:, axis])
    return np.sqrt(square, out=square)


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
