"""Which vertex of a rig is which vertex of the mesh that the Gaussians sit on.

The two meshes were written by different tools: the same surface, but vertices split at seams, renumbered, with
triangles in another order, and in another pose. Only the connectivity is alike, so that is what is compared: a
map holds if it takes the rig's triangles, as oriented triples, to the mesh's, whatever their order.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.rigs.mesh_matching import Surface, hash64, isomorphism
from avatar_runtime.avatar import F32, I64, U32, Rig, SparseRows
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.topology import topology_hash

U64 = npt.NDArray[np.uint64]


@dataclass(frozen=True)
class VertexMap:
    """What `vertex_map` found."""

    rows: I64  # [V] for each vertex of the mesh a vertex of the rig
    how: str  # what decided, in words
    disagreeing: int = 0  # vertices whose copies in the rig differ in weights or morphs; the first is taken


@dataclass(frozen=True)
class _Meshes:
    rig: Rig
    vertex_ids: I64 | None  # [rig vertices]
    triangles: I64  # [F, 3] without those that have a corner twice
    vertices: F32  # [V, 3]


def vertex_map(rig: Rig, vertex_ids: I64 | None, triangles: U32, vertices: F32) -> VertexMap:
    """The rig's vertex for each of `vertices` [V, 3] (binding pose; only used to tell equal parts apart).

    `vertex_ids`: for each vertex of the rig the row it had where it was made, if its file says so. Tried in
    order: the same numbering, those ids, the same order of triangles, and the connectivity itself. A vertex
    in no triangle goes to vertex 0 of the rig, or keeps its number. Raises AvatarError where none holds.
    """
    meshes = _Meshes(rig, vertex_ids, _proper(triangles.astype(np.int64)), vertices)
    for how, attempt in ATTEMPTS.items():
        for classes in attempt(meshes):
            rows = _checked(meshes, classes)
            if rows is not None:
                return VertexMap(rows, how, _differing(rig, classes, _data_hash(rig)))
    raise AvatarError(_difference(meshes, triangles))


def _same_numbering(m: _Meshes) -> Iterator[I64]:
    if len(m.rig.vertices) == len(m.vertices):
        yield np.arange(len(m.rig.vertices))


def _by_ids(m: _Meshes) -> Iterator[I64]:
    if m.vertex_ids is not None:
        yield m.vertex_ids


def _by_triangle_order(m: _Meshes) -> Iterator[I64]:
    """Corner k of triangle f is corner k of triangle f."""
    rig_triangles = m.rig.triangles.astype(np.int64)
    for corners in (rig_triangles, _proper(rig_triangles)):
        if len(corners) == len(m.triangles):
            classes = np.full(len(m.rig.vertices), -1)
            classes[corners.reshape(-1)] = m.triangles.reshape(-1)
            yield classes


def _by_connectivity(m: _Meshes) -> Iterator[I64]:
    """Surfaces with seams closed, as tightly as need be, and then matched."""
    goal = Surface(m.triangles, len(m.vertices), m.vertices)
    for weld in _welds(m.rig):
        corners = _proper(weld[m.rig.triangles.astype(np.int64)])
        count = int(weld.max(initial=-1)) + 1
        points = np.zeros((count, 3), np.float32)
        points[weld] = m.rig.vertices
        found = isomorphism(Surface(corners, count, points), goal)
        if found is not None:
            yield found[weld]


ATTEMPTS: dict[str, Callable[[_Meshes], Iterator[I64]]] = {
    "the same numbering": _same_numbering,
    "the vertex ids in the file": _by_ids,
    "the order of the triangles": _by_triangle_order,
    "their connectivity": _by_connectivity,
}


def _checked(m: _Meshes, classes: I64) -> I64 | None:
    """[V] rows of the rig, if `classes` [rig vertices] (-1: none) takes the rig's triangles to the mesh's."""
    v = len(m.vertices)
    corners = classes[m.rig.triangles.astype(np.int64)]
    if ((corners < 0) | (corners >= v)).any():
        return None
    if not np.array_equal(cyclic_triples(_proper(corners)), cyclic_triples(m.triangles)):
        return None
    if _differing(m.rig, classes, _place_hash(m.rig)):
        return None  # triangles that share no vertex would go anywhere
    rows = np.arange(v) if len(classes) == v and np.array_equal(classes, np.arange(v)) else np.zeros(v, int)
    used = np.unique(m.rig.triangles)[::-1]  # the first copy is written last
    rows[classes[used]] = used
    return rows


def cyclic_triples(triangles: I64) -> I64:
    """[F, 3] sorted: each triangle turned until its smallest corner is first."""
    first = np.argmin(triangles, axis=1)[:, None]
    turned = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
    result: I64 = turned[np.lexsort(turned.T[::-1])]
    return result


def _proper(triangles: I64) -> I64:
    """Without triangles that have a corner twice: welding a rig closes slivers, a mesh may have dropped them."""
    a, b, c = triangles.T
    result: I64 = triangles[(a != b) & (b != c) & (c != a)]
    return result


def _welds(rig: Rig) -> Iterator[I64]:
    """Ways to number the vertices with copies as one: none, equal in everything, equal in place."""
    yield np.arange(len(rig.vertices))
    places = _place_hash(rig)
    for key in (hash64(places + _data_hash(rig)), places):
        yield np.unique(key, return_inverse=True)[1].reshape(-1)


def _place_hash(rig: Rig) -> U64:
    bits = np.ascontiguousarray(rig.vertices + np.float32(0)).view(np.uint32).astype(np.uint64)  # -0 -> 0
    return hash64(hash64(hash64(bits[:, 0]) + bits[:, 1]) + bits[:, 2])


def _data_hash(rig: Rig) -> U64:
    return hash64(_row_hash(rig.skin) + hash64(_row_hash(rig.morphs)))


def _row_hash(rows: SparseRows) -> U64:
    """[R] equal for rows with equal entries, in whatever order."""
    entry = hash64(rows.column.astype(np.uint64) + np.uint64(1))
    for value in rows.values.values():
        for part in value.reshape(len(value), math.prod(value.shape[1:])).T:
            entry = hash64(entry + np.ascontiguousarray(part, np.float32).view(np.uint32))
    sums = np.concatenate([np.zeros(1, np.uint64), np.cumsum(entry, dtype=np.uint64)])
    result: U64 = sums[rows.row_ptr[1:]] - sums[rows.row_ptr[:-1]]
    return result


def _differing(rig: Rig, classes: I64, data: U64) -> int:
    """How many classes have used vertices that differ in `data` [rig vertices]."""
    used = np.unique(rig.triangles)
    pairs: npt.NDArray[Any] = np.stack([classes[used].astype(np.uint64), data[used]], axis=1)
    distinct = np.unique(pairs, axis=0)
    return int(np.count_nonzero(np.bincount(distinct[:, 0].astype(np.int64)) > 1))


def _difference(m: _Meshes, triangles: U32) -> str:
    rig_triangles, weld = m.rig.triangles, list(_welds(m.rig))[-1]
    counts = [
        f"{len(np.unique(t))} vertices in {len(t)} triangles (topology {topology_hash(t, v)[:12]})"
        for t, v in ((triangles, len(m.vertices)), (rig_triangles, len(m.rig.vertices)))
    ]
    welded = len(np.unique(weld[rig_triangles.astype(np.int64)]))
    alike = len(np.unique(triangles)) == welded and len(triangles) == len(rig_triangles)
    hint = (
        "; as many of each, so one may be wound the other way, or cut along other diagonals" if alike else ""
    )
    return (
        f"the mesh has {counts[0]}, the rig {counts[1]}, {welded} once seams are closed, and no numbering "
        f"takes one to the other{hint}; give a rig of the very mesh that the avatar was trained on, triangulated alike"
    )
