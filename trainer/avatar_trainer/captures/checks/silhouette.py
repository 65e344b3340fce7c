"""The silhouette of the tracked mesh against the mask, on a coarse grid of cells.

Points are spread evenly over the triangles of the mesh; a cell is in the silhouette if one of them falls into it. That
is exact enough for conventions, which move a silhouette by much of its size, and needs no rasteriser.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from avatar_runtime import F32, F64, I64, U32
from avatar_trainer.captures.checks.conventions import View

CELLS = 40  # along the longer side of an image
POINTS = 8_000  # on the mesh: some ten in each cell of a head that fills a third of its image
NEAR = 0.01  # metres before the camera

Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class SurfacePoints:
    """Points that are spread evenly over a mesh, whatever its pose."""

    triangles: I64  # [P, 3] vertex indices
    weights: F64  # [P, 3] barycentric

    def at(self, vertices: F64) -> F64:
        """[P, 3] of the mesh with `vertices` [V, 3]."""
        points: F64 = np.einsum("pc,pcx->px", self.weights, vertices[self.triangles])
        return points

    def normals(self, vertices: F64) -> F64:
        """[P, 3] of the triangles on which the points lie, of unit length."""
        corner = vertices[self.triangles]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        result: F64 = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
        return result


def spread(vertices: F32, triangles: U32, count: int = POINTS) -> SurfacePoints:
    """`count` points on a mesh, by area; the same ones each time."""
    corner = vertices.astype(np.float64)[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    ends = np.cumsum(area)
    chosen = np.searchsorted(ends, (np.arange(count) + 0.5) / count * ends[-1])
    rng = np.random.default_rng(0)
    a, b = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1 - a, a * (1 - b), a * b], axis=1)
    return SurfacePoints(triangles[chosen].astype(np.int64), weights)


@dataclass(frozen=True)
class Overlap:
    """Areas in cells, summed over images."""

    mesh: float
    mask: float
    both: float

    def __add__(self, other: Overlap) -> Overlap:
        return Overlap(self.mesh + other.mesh, self.mask + other.mask, self.both + other.both)

    @cached_property
    def inside(self) -> float:
        """The share of the silhouette that lies inside the mask; 0 without a silhouette."""
        return self.both / self.mesh if self.mesh else 0.0

    @cached_property
    def union(self) -> float:
        """The share of silhouette and mask that both have: 1 for equal ones."""
        return self.both / max(self.mesh + self.mask - self.both, 1e-9)


def cells_of(mask: F32) -> Mask:
    """The cells [h, w] in which a mask [H, W] has a pixel above one half."""
    h, w = mask.shape
    rows, columns = grid(w, h)
    down, across = (np.arange(n) * size // n for n, size in ((rows, h), (columns, w)))
    return np.logical_or.reduceat(np.logical_or.reduceat(mask > 0.5, down, axis=0), across, axis=1)


def grid(width: int, height: int) -> tuple[int, int]:
    """(rows, columns) of the grid of an image; never finer than its pixels."""
    cell = max(1.0, max(width, height) / CELLS)
    return max(1, round(height / cell)), max(1, round(width / cell))


@dataclass(frozen=True)
class Seen:
    """Points [P, 3] of a mesh as a camera sees them."""

    place: F64  # [P, 2] pixels, pixel centres at half integers; NaN behind the camera
    depth: F64  # [P] metres
    cell: I64  # [P] of the grid, row-major; -1 outside the image

    def cells(self, rows: int, columns: int) -> Mask:
        """The silhouette: the cells [rows, columns] onto which a point falls."""
        hit = np.zeros(rows * columns, np.bool_)
        hit[self.cell[self.cell >= 0]] = True
        return hit.reshape(rows, columns)


def project(points: F64, view: View) -> Seen:
    """Points [P, 3] of the posed mesh, in avatar space, in the image of a camera."""
    rows, columns = grid(view.width, view.height)
    matrix = view.intrinsics @ (view.camera_from_world @ view.world_from_avatar)[:3]
    seen = points @ matrix[:, :3].T + matrix[:, 3]
    depth = seen[:, 2]
    with np.errstate(all="ignore"):
        place = np.where(depth[:, None] > NEAR, seen[:, :2] / depth[:, None], np.nan)
        inside: Mask = np.all((place >= 0) & (place < (view.width, view.height)), axis=1)
        scaled = np.where(inside[:, None], place, 0) * (columns / view.width, rows / view.height)
    cell = np.minimum(scaled.astype(np.int64), (columns - 1, rows - 1))
    return Seen(place, depth, np.where(inside, cell[:, 1] * columns + cell[:, 0], -1))


def overlap(hit: Mask, mask: Mask) -> Overlap:
    """A silhouette against the cells of a mask."""
    return Overlap(float(hit.sum()), float(mask.sum()), float((hit & mask).sum()))
