"""Poisson-disk samples on a mesh, and how the triangle under a sample deforms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import inverse_transpose, quat_from_matrix
from avatar_trainer.head import Head, Mesh, unit

Array = npt.NDArray[Any]

CANDIDATES = 6  # for each sample that is wanted
# A maximal Poisson-disk set of radius r holds about this many points on an area r^2.
PACKING = 0.72
NEIGHBOURS = 6
MOST_SPACING = 1.5  # of the region's median, since a sample at the region's edge lacks neighbours
# The share of an edge's length in an opening shape that a fixed splat covers, and its largest growth for that.
OPENING_SHARE, OPENING_LIMIT = 0.85, 3.0


@dataclass(frozen=True)
class Samples:
    """N points on a surface."""

    face: Array  # i64 [N]
    bary: Array  # f64 [N, 3]
    position: Array  # f64 [N, 3], metres
    frame: Array  # f64 [N, 3, 3], columns: two tangents, outward normal
    spacing: Array  # f64 [N], mean distance to the NEIGHBOURS nearest other samples, metres

    def interpolate(self, values: Array, triangles: Array) -> Array:
        """Vertex values [V, ...] at the samples [N, ...]."""
        result: Array = np.einsum("nc,nc...->n...", self.bary, values[triangles[self.face]])
        return result


def near_pairs(points: Array, radius: float) -> tuple[Array, Array, Array]:
    """All pairs (i, j) closer than radius, once each, and their distances, by a grid of cells."""
    cell = np.floor((points - points.min(axis=0)) / radius).astype(np.int64) + 1
    size = cell.max(axis=0) + 2
    stride = np.array([size[1] * size[2], size[2], 1])
    key = cell @ stride
    order = np.argsort(key, kind="stable")
    sorted_key = key[order]
    shifts = [(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) >= (0, 0, 0)]
    found: list[tuple[Array, Array]] = []
    for shift in shifts:
        wanted = sorted_key + np.array(shift) @ stride
        first = np.searchsorted(sorted_key, wanted, side="left")
        if shift == (0, 0, 0):
            first = np.arange(len(order)) + 1
        count = np.maximum(np.searchsorted(sorted_key, wanted, side="right") - first, 0)
        a = np.repeat(np.arange(len(order)), count)
        b = np.arange(len(a)) - np.repeat(np.cumsum(count) - count, count) + np.repeat(first, count)
        found.append((order[a], order[b]))
    i, j = (np.concatenate(side) for side in zip(*found, strict=True))
    distance = np.linalg.norm(points[i] - points[j], axis=1)
    close = distance < radius
    return i[close], j[close], distance[close]


def independent_set(count: int, i: Array, j: Array) -> Array:
    """Greedy choice in index order: mask [count] of points none of which share a pair, none can be added."""
    chosen = np.zeros(count, bool)
    open_ = np.ones(count, bool)
    low, high = np.minimum(i, j), np.maximum(i, j)
    while len(low):
        beaten = np.zeros(count, bool)
        beaten[high] = True
        winners = open_ & ~beaten
        chosen |= winners
        open_[winners] = False
        open_[high[winners[low]]] = False
        left = open_[low] & open_[high]
        low, high = low[left], high[left]
    return chosen | open_


def poisson_disk(points: Array, normals: Array, count: int, area: float) -> tuple[Array, float]:
    """Indices of `count` well spaced points among candidates in random order, and their radius.

    Points that face away from each other (the two sides of a lid) do not repel. The radius is the largest
    that still leaves enough points; the few excess ones are removed where the spacing is smallest.
    """
    high = 1.25 * float(np.sqrt(PACKING * area / count))
    i, j, distance = near_pairs(points, high)
    same_side = np.sum(normals[i] * normals[j], axis=1) > 0
    i, j, distance = i[same_side], j[same_side], distance[same_side]
    low = high / 2
    for _ in range(7):
        radius = (low + high) / 2
        close = distance < radius
        enough = int(independent_set(len(points), i[close], j[close]).sum()) >= count
        low, high = (radius, high) if enough else (low, radius)
    close = distance < low
    mask = independent_set(len(points), i[close], j[close])
    kept = np.flatnonzero(mask)
    both = mask[i] & mask[j]
    nearest = np.full(len(points), np.inf)
    np.minimum.at(nearest, np.maximum(i, j)[both], distance[both])
    tight_first = kept[np.argsort(nearest[kept], kind="stable")]
    return np.sort(tight_first[len(kept) - count :]), low


def neighbour_distance(points: Array, normals: Array, radius: float) -> Array:
    """Mean distance [N] to the nearest NEIGHBOURS on the same side; at most 2.5 radii."""
    reach = 2.5 * radius
    i, j, distance = near_pairs(points, reach)
    same_side = np.sum(normals[i] * normals[j], axis=1) > 0
    a = np.concatenate([i[same_side], j[same_side]])
    d = np.concatenate([distance[same_side]] * 2)
    order = np.lexsort((d, a))
    a, d = a[order], d[order]
    rank = np.arange(len(a)) - np.searchsorted(a, a)
    near = rank < NEIGHBOURS
    count = np.bincount(a[near], minlength=len(points))
    total = np.bincount(a[near], d[near], len(points))
    result: Array = (total + (NEIGHBOURS - count) * reach) / NEIGHBOURS
    return result


def sample_region(mesh: Mesh, held: Mesh, triangles: Array, count: int, rng: np.random.Generator) -> Samples:
    """`count` samples on the triangles (indices) given, evenly spread over their area in `held`.

    `held` is the same mesh in another pose; the samples lie on `mesh`, with the larger spacing of the two.
    """
    corner = held.vertices[mesh.triangles[triangles]]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 2
    total = CANDIDATES * count
    place = (np.arange(total) + rng.random(total)) / total * area.sum()
    chosen = np.minimum(np.searchsorted(np.cumsum(area), place), len(triangles) - 1)
    chosen = chosen[rng.permutation(total)]
    root, along = np.sqrt(rng.random(total)), rng.random(total)
    bary = np.stack([1 - root, root * (1 - along), root * along], axis=1)
    face = triangles[chosen]
    spread = np.einsum("nc,ncx->nx", bary, corner[chosen])
    facing = unit(np.einsum("nc,ncx->nx", bary, held.vertex_normals[mesh.triangles[face]]))
    kept, radius = poisson_disk(spread, facing, count, float(area.sum()))
    face, bary = face[kept], bary[kept]
    at = mesh.triangles[face]
    position = np.einsum("nc,ncx->nx", bary, mesh.vertices[at])
    normal = unit(np.einsum("nc,ncx->nx", bary, mesh.vertex_normals[at]))
    across = unit(np.cross(normal, mesh.vertices[at[:, 1]] - mesh.vertices[at[:, 0]]))
    frame = np.stack([np.cross(across, normal), across, normal], axis=-1)
    spacing = np.maximum(
        neighbour_distance(position, normal, radius), neighbour_distance(spread[kept], facing[kept], radius)
    )
    return Samples(face, bary, position, frame, spacing)


def vertex_samples(head: Head, opening: tuple[str, ...]) -> Samples:
    """One sample at each vertex; frame and spacing follow the edges that leave it.

    The tangents are the main directions of the edges, so that a splat as long and wide as they are fills the
    quads of the mesh; `spacing` is [N, 2] here, the root mean square of the edges along each tangent. Edges
    that one of the `opening` shapes stretches count as longer, as a splat of fixed size has to cover both.
    """
    face, corner = np.zeros(len(head.vertices), np.int64), np.zeros(len(head.vertices), np.int64)
    for c in range(3):
        face[head.triangles[:, c]] = np.arange(len(head.triangles))
        corner[head.triangles[:, c]] = c
    normal = head.vertex_normals
    seed = unit(np.cross(normal, np.where(np.abs(normal[:, :1]) < 0.7, (1.0, 0, 0), (0, 1.0, 0))))
    plane = np.stack([seed, np.cross(normal, seed)], axis=1)
    start, end = np.concatenate([head.triangles[:, [i, j]] for i in range(3) for j in range(3) if i != j]).T
    edge = np.einsum("eij,ej->ei", plane[start], head.vertices[end] - head.vertices[start])
    length = np.linalg.norm(head.vertices[end] - head.vertices[start], axis=1)
    longest = length.copy()
    for name in opening:
        moved = head.vertices + head.expression(name)
        longest = np.maximum(longest, OPENING_SHARE * np.linalg.norm(moved[end] - moved[start], axis=1))
    edge *= np.minimum(longest / length, OPENING_LIMIT)[:, None]
    moment = np.zeros((len(normal), 2, 2))
    np.add.at(moment, start, edge[:, :, None] * edge[:, None, :])
    moment /= np.maximum(np.bincount(start, minlength=len(normal)), 1)[:, None, None]
    square, axes = np.linalg.eigh(moment)
    tangent = np.einsum("nij,nik->njk", axes, plane)
    frame = np.stack([tangent[:, 0], np.cross(normal, tangent[:, 0]), normal], axis=-1)
    return Samples(
        face,
        np.eye(3)[corner],
        head.vertices,
        frame,
        np.sqrt(np.maximum(square, 0)),
    )


def sample_mesh(
    mesh: Mesh, regions: Array, spacing: Array, count: int, seed: int, held: Mesh | None = None
) -> Samples:
    """`count` samples over the triangles with region >= 0; spacing[r] is relative, and even in `held`."""
    held = held or mesh
    rng = np.random.default_rng(seed)
    corner = held.vertices[mesh.triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 2
    used = regions >= 0
    share = np.bincount(regions[used], area[used], len(spacing)) / spacing**2
    edges = np.round(np.cumsum(share) / share.sum() * count).astype(int)
    counts = np.diff(edges, prepend=0)
    parts = [
        sample_region(mesh, held, np.flatnonzero(regions == r), int(n), rng)
        for r, n in enumerate(counts)
        if n
    ]
    fields = ("face", "bary", "position", "frame", "spacing")
    return Samples(*(np.concatenate([getattr(p, f) for p in parts]) for f in fields))


def spacing_on(mesh: Mesh, samples: Samples, regions: Array) -> Array:
    """The samples' distances [N] to their neighbours of the same region in this pose of the mesh, metres."""
    position = samples.interpolate(mesh.vertices, mesh.triangles)
    normal = unit(samples.interpolate(mesh.vertex_normals, mesh.triangles))
    region = regions[samples.face]
    result = np.zeros(len(position))
    for r in np.unique(region):
        rows = np.flatnonzero(region == r)
        radius = float(np.median(samples.spacing[rows]))
        far = neighbour_distance(position[rows], normal[rows], radius)
        result[rows] = np.minimum(far, MOST_SPACING * np.median(far))
    return result


def triangle_frames(corner: Array) -> Array:
    """[N, 3, 3]: columns two edges and the normal divided by the root of its length; corner [N, 3, 3]."""
    e1, e2 = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    n = np.cross(e1, e2)
    n /= np.sqrt(np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-20))
    return np.stack([e1, e2, n], axis=-1)


def rotation_of(gradient: Array) -> Array:
    """Rotation factor [N, 3, 3] of deformation gradients (determinant > 0), by Newton's iteration."""
    for _ in range(8):
        gradient = (gradient + inverse_transpose(gradient)) / 2
    return gradient


def deformation(before: Array, after: Array, position: Array) -> tuple[Array, Array, Array]:
    """The motion of points on triangles [N, 3, 3] (corner, axis).

    Returns the shift of `position` [N, 3], (Q - I) x + t with the affine deformation gradient Q; the rotation
    of Q as a unit quaternion wxyz [N, 4]; and Q [N, 3, 3]. Source: Sumner and Popovic 2004, section 3.
    """
    gradient = triangle_frames(after) @ np.linalg.inv(triangle_frames(before))
    moved = np.einsum("nij,nj->ni", gradient, position - before[:, 0]) + after[:, 0]
    return moved - position, quat_from_matrix(rotation_of(gradient)), gradient
