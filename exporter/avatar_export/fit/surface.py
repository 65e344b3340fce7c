"""How far Gaussians lie from the triangles of a mesh, by group, and the known change that would bring them there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from avatar_export.fit.closest import Nearest, Triangles
from avatar_export.fit.known import Change, Search, explanation
from avatar_runtime.avatar import F32, F64, I64, U32, Avatar, Group

SAMPLES = 1000  # Gaussians of a group that are measured
FEWEST = 16  # of a group that is judged; a median of fewer says little
SEARCHED = 150  # points of a search
ROUGH_VERTICES = 1500  # of the mesh, for a rough search
FARTHEST = 1e18  # metres in a rough search: float32 holds its square


@dataclass(frozen=True)
class Mesh:
    """Triangles that Gaussians should lie on, in metres."""

    vertices: F64  # [V, 3]
    triangles: U32  # [F, 3]

    @staticmethod
    def of(vertices: F32 | F64, triangles: U32) -> Mesh:
        """The mesh in double precision."""
        return Mesh(vertices.astype(np.float64), triangles)

    @property
    def sound(self) -> bool:
        """Whether there are triangles, of finite corners; what is not is refused elsewhere."""
        return len(self.triangles) > 0 and bool(np.isfinite(self.used).all())

    @property
    def used(self) -> F64:
        """The vertices [U, 3] that a triangle uses."""
        return self.vertices[np.unique(self.triangles)]

    @property
    def edge(self) -> float:
        """The median length of its edges, metres."""
        corner = self.vertices[self.triangles]
        return float(np.median(np.linalg.norm(corner - np.roll(corner, 1, axis=1), axis=2)))

    def nearest(self, points: F64) -> Nearest:
        """The nearest points to `points` [N, 3]."""
        return self._searched.nearest(points)

    @cached_property
    def _searched(self) -> Triangles:
        return Triangles.of(self.vertices, self.triangles)

    def places(self, points: F64) -> F64:
        """[N, 3] the nearest points themselves."""
        found = self.nearest(points)
        corner = self.vertices[self.triangles[found.triangle]]
        places: F64 = np.einsum("ij,ijk->ik", found.barycentric, corner)
        return places


@dataclass(frozen=True)
class GroupFit:
    """The distances of one group's opaque Gaussians from the mesh, metres."""

    name: str
    count: int  # Gaussians measured
    median: float
    far: float  # the 99 % quantile
    largest: float


def opaque_rows(avatar: Avatar, group: Group, most: int = SAMPLES) -> I64:
    """Rows of at most `most` Gaussians of a group that are at least half opaque, evenly spaced.

    Of a group with few such ones: of its more opaque half."""
    opacity = avatar.gaussians.opacity_logit[group.first : group.first + group.count]
    mean = avatar.gaussians.mean[group.first : group.first + group.count]
    finite: npt.NDArray[np.bool_] = np.all(np.isfinite(mean), axis=1)
    rows = np.flatnonzero((opacity >= 0) & finite)
    if len(rows) < min(FEWEST, group.count):
        rows = np.argsort(-opacity, kind="stable")[: (group.count + 1) // 2]
        rows = np.sort(rows[finite[rows]])
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(most, len(rows))).astype(np.int64))]
    return (group.first + rows).astype(np.int64)


def size_of(points: F64) -> float:
    """The diagonal of the box of `points` [N, 3]."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0


def group_fits(avatar: Avatar, mesh: Mesh) -> tuple[list[GroupFit], float]:
    """(fit of each group with enough Gaussians, the size that distances are compared with).

    The size is the diagonal of the mesh, or that of all measured Gaussians if it is smaller: else Gaussians in metres
    would lie well within a mesh in millimetres.
    """
    fits, measured = [], []
    for group in avatar.groups:
        rows = opaque_rows(avatar, group)
        if len(rows) < FEWEST:
            continue
        points = avatar.gaussians.mean[rows].astype(np.float64)
        distance = mesh.nearest(points).distance
        median, far, largest = (float(value) for value in np.quantile(distance, (0.5, 0.99, 1.0)))
        fits.append(GroupFit(group.name, len(rows), median, far, largest))
        measured.append(points)
    whole = size_of(np.concatenate(measured)) if measured else 0.0
    return fits, min(size_of(mesh.used), whole)


def explained(points: F64, mesh: Mesh, limit: float, pairs: bool) -> tuple[Change, float] | None:
    """The known change of `points` [N, 3] that brings them within `limit` of the mesh (see `known.explanation`)."""
    sample = points[np.unique(np.linspace(0, len(points) - 1, min(SEARCHED, len(points))).astype(np.int64))]
    vertices = mesh.used
    coarse = vertices[:: max(1, len(vertices) // ROUGH_VERTICES)]
    middle = coarse.mean(axis=0)
    columns = np.vstack([(coarse - middle).T, np.square(coarse - middle).sum(axis=1)]).astype(np.float32)

    def rough(given: F64) -> F64:
        off = np.clip(given - middle, -FARTHEST, FARTHEST)
        p = np.hstack([-2 * off, np.ones((len(off), 1))]).astype(np.float32)
        places: F64 = coarse[np.argmin(p @ columns, axis=1)]
        return places

    own, goal = ((p.min(axis=0), p.max(axis=0)) for p in (points, vertices))
    return explanation(Search(sample, rough, mesh.places, own, goal), limit, pairs)
