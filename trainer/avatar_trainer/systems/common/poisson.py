"""Evenly spread points on a triangle mesh, and the distances between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import prange

from avatar_runtime import F64, I64
from avatar_runtime.backends.cpu import kernel

CANDIDATES = 8  # random points for each that is wanted
PACKING = 0.72  # a maximal Poisson-disk set of radius r holds about this many points on an area r^2
SEARCH_STEPS = 12
SMALLEST = 1e-30  # metres squared


@dataclass(frozen=True)
class Samples:
    """N points on a mesh."""

    triangle: I64  # [N]
    barycentric: F64  # [N, 3] weights of its corners
    position: F64  # [N, 3] metres

    @staticmethod
    def joined(parts: Sequence[Samples]) -> Samples:
        """The points of all parts."""
        fields = ("triangle", "barycentric", "position")
        return Samples(*(np.concatenate([getattr(part, name) for part in parts]) for name in fields))

    def interpolate(self, values: npt.NDArray[np.floating], triangles: I64) -> F64:
        """Vertex values [V, ...] at the points, [N, ...]."""
        result: F64 = np.einsum("nc,nc...->n...", self.barycentric, values[triangles[self.triangle]])
        return result

    def mean_of_corners(self, values: npt.NDArray[np.floating], triangles: I64) -> F64:
        """The plain mean of vertex values [V, ...] over the corners of each point's triangle, [N, ...]."""
        result: F64 = values[triangles[self.triangle]].astype(np.float64).mean(axis=1)
        return result


def poisson_disk(
    vertices: F64, triangles: I64, chosen: I64, count: int, generator: np.random.Generator
) -> Samples:
    """`count` well spaced points on the triangles named by `chosen`.

    Darts are thrown in random order; one is kept if no kept one lies within the radius on the same side of the
    surface (two lips that touch do not repel each other). The radius is the largest found that leaves enough;
    the last kept darts are dropped (Bowers et al. 2010 want the same distribution, without a fixed count).
    Raises ValueError for no triangle or no area.
    """
    corner = vertices[triangles[chosen]]
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(cross, axis=1) / 2
    total = float(area.sum())
    if not total > 0:
        raise ValueError("the triangles to sample have no area")
    darts = CANDIDATES * count
    place = (np.arange(darts) + generator.random(darts)) / darts * total
    face = np.minimum(np.searchsorted(np.cumsum(area), place), len(chosen) - 1)
    face = face[generator.permutation(darts)]
    root, along = np.sqrt(generator.random(darts)), generator.random(darts)
    barycentric = np.stack([1 - root, root * (1 - along), root * along], axis=1)
    position = np.einsum("nc,ncx->nx", barycentric, corner[face])
    normal = cross[face] / np.maximum(2 * area[face, None], SMALLEST)
    kept = _best_set(position, normal, count, total)
    return Samples(chosen[face[kept]], barycentric[kept], position[kept])


def _best_set(position: F64, normal: F64, count: int, area: float) -> I64:
    """Rows of the first `count` darts kept at the largest radius that keeps at least that many."""
    low, high = 0.0, 1.25 * float(np.sqrt(PACKING * area / count))
    best: I64 = np.arange(count)
    for _ in range(SEARCH_STEPS):
        radius = (low + high) / 2
        kept = throw_darts(position, normal, radius)
        if len(kept) >= count:
            low, best = radius, kept[:count]
        else:
            high = radius
    return np.sort(best)


@kernel()
def throw_darts(position: F64, normal: F64, radius: float) -> I64:
    """Rows kept, in order: each at least `radius` from every kept one before it that faces the same way."""
    n = len(position)
    buckets = 1
    while buckets < 2 * n:
        buckets *= 2
    first = np.full(buckets, -1, np.int64)
    following = np.full(n, -1, np.int64)
    kept = np.empty(n, np.int64)
    found = 0
    for row in range(n):
        x, y, z = (
            np.int64(np.floor(position[row, 0] / radius)),
            np.int64(np.floor(position[row, 1] / radius)),
            np.int64(np.floor(position[row, 2] / radius)),
        )
        free = True
        for step in range(27):
            i, j, k = x + step % 3 - 1, y + step // 3 % 3 - 1, z + step // 9 - 1
            other = first[((i * 73856093) ^ (j * 19349663) ^ (k * 83492791)) & (buckets - 1)]
            while other >= 0 and free:
                distance, facing = 0.0, 0.0
                for axis in range(3):
                    distance += (position[row, axis] - position[other, axis]) ** 2
                    facing += normal[row, axis] * normal[other, axis]
                free = distance >= radius * radius or facing <= 0
                other = following[other]
            if not free:
                break
        if free:
            bucket = ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & (buckets - 1)
            following[row] = first[bucket]
            first[bucket] = row
            kept[found] = row
            found += 1
    return kept[:found]


def neighbour_distance(position: F64) -> F64:
    """Root of the mean squared distance of each point [N, 3] to its three nearest others (all, if fewer), [N]."""
    if not len(position):
        return np.zeros(0)
    axis = int(np.argmax(np.ptp(position, axis=0)))
    order = np.argsort(position[:, axis], kind="stable")
    result = np.empty(len(position))
    result[order] = _swept(position[order], axis)
    return result


@kernel(parallel=True)
def _swept(position: F64, axis: int) -> F64:
    """`neighbour_distance` of points that rise along `axis`: a search ends where that alone is too far."""
    n = len(position)
    result = np.zeros(n)
    for row in prange(n):
        a, b, c = np.inf, np.inf, np.inf
        for step in (-1, 1):
            other = row + step
            while 0 <= other < n and (position[row, axis] - position[other, axis]) ** 2 <= c:
                distance = 0.0
                for k in range(3):
                    distance += (position[row, k] - position[other, k]) ** 2
                if distance < a:
                    a, b, c = distance, a, b
                elif distance < b:
                    b, c = distance, b
                elif distance < c:
                    c = distance
                other += step
        total, found = 0.0, 0
        for distance in (a, b, c):
            if distance < np.inf:
                total += distance
                found += 1
        result[row] = np.sqrt(total / found) if found > 0 else 0.0
    return result
