"""The map from the vertices of a rig to those of the mesh under the Gaussians.

Different tools wrote the two meshes: the same surface, but vertices are split at seams and renumbered, triangles have
another order, and the pose differs. Only the connectivity is equal, so the connectivity is compared: a map is valid if
it takes the rig's triangles, as oriented triples, to the mesh's, in any order.
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
    """The result of `vertex_map`."""

    rows: I64  # [V] for each vertex of the mesh a vertex of the rig
    how: str  # the method that found it, in words
    # Number of vertices whose copies in the rig differ in weights or morphs; the first copy is used.
    disagreeing: int = 0


@dataclass(frozen=True)
class _Meshes:
    rig: Rig
    vertex_ids: I64 | None  # [rig vertices]
    triangles: I64  # [F, 3] without degenerate ones
    vertices: F32  # [V, 3]


def vertex_map(rig: Rig, vertex_ids: I64 | None, triangles: U32, vertices: F32) -> VertexMap:
    """The rig's vertex for each of `vertices` [V, 3] (binding pose; only used to tell equal parts apart).

    `vertex_ids`: for each vertex of the rig its row in the mesh that the rig was made from, if the file stores it.
    Tried in order: the same numbering, those ids, the same order of triangles, and the connectivity. A vertex without
    a triangle maps to vertex 0 of the rig, or keeps its number. Raises AvatarError if no map is valid.
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
    """The map by which corner k of triangle f is corner k of triangle f."""
    rig_triangles = m.rig.triangles.astype(np.int64)
    for corners in (rig_triangles, _proper(rig_triangles)):
        if len(corners) == len(m.triangles):
            classes = np.full(len(m.rig.vertices), -1)
            classes[corners.reshape(-1)] = m.triangles.reshape(-1)
            yield classes


def _by_connectivity(m: _Meshes) -> Iterator[I64]:
    """The map between the two surfaces, with seams closed as far as needed."""
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
        return None  # triangles without shared vertices could be mapped anywhere
    rows = np.arange(v) if len(classes) == v and np.array_equal(classes, np.arange(v)) else np.zeros(v, int)
    used = np.unique(m.rig.triangles)[::-1]  # so that the first copy is written last
    rows[classes[used]] = used
    return rows


def cyclic_triples(triangles: I64) -> I64:
    """[F, 3] sorted: each triangle rotated so that its smallest corner is first."""
    first = np.argmin(triangles, axis=1)[:, None]
    turned = np.take_along_axis(triangles, (first + np.arange(3)) % 3, axis=1)
    result: I64 = turned[np.lexsort(turned.T[::-1])]
    return result


def _proper(triangles: I64) -> I64:
    """The triangles without degenerate ones: welding a rig closes slivers that a mesh may lack."""
    a, b, c = triangles.T
    result: I64 = triangles[(a != b) & (b != c) & (c != a)]
    return result


def _welds(rig: Rig) -> Iterator[I64]:
    """Numberings in which copies of a vertex are one: no copies, equal in all data, equal in position."""
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
    """[R] a hash, equal for rows with equal entries in any order."""
    entry = hash64(rows.column.astype(np.uint64) + np.uint64(1))
    for value in rows.values.values():
        for part in value.reshape(len(value), math.prod(value.shape[1:])).T:
            entry = hash64(entry + np.ascontiguousarray(part, np.float32).view(np.uint32))
    sums = np.concatenate([np.zeros(1, np.uint64), np.cumsum(entry, dtype=np.uint64)])
    result: U64 = sums[rows.row_ptr[1:]] - sums[rows.row_ptr[:-1]]
    return result


def _differing(rig: Rig, classes: I64, data: U64) -> int:
    """The number of classes whose used vertices differ in `data` [rig vertices]."""
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
    hint = "; the counts are equal, so the winding or the diagonals of quads may differ" if alike else ""
    return (
        f"the mesh has {counts[0]}; the rig has {counts[1]}, and {welded} with seams closed; no numbering "
        f"maps one to the other{hint}; pass a rig of the mesh that the avatar was trained on, with the same triangles"
    )
