"""An unwrap of a head: one place in the plane for each vertex, without folded triangles.

Texture coordinates of game meshes have seams, mirrored and overlapping charts; mixtures in the plane (ASM, Eq. 4)
would jump or leak there. Here vertices at the same place count as one, the longest border (the neck's) becomes a
circle, and every other vertex is the weighted mean of its neighbours. With positive weights such a map has no folds
(Tutte 1963, Floater 1997). Cotangent weights preserve angles. A Moebius map then moves the face into the middle, and
a change of radius gives each ring the same share of the disc as of the head.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime import F64, I64, AvatarError

LEAST_WEIGHT, MOST_WEIGHT = 0.02, 20.0  # of an edge; cotangents of obtuse angles are negative
RINGS = (60, 30, 15, 8)  # at which the change of radius is known: fewer where large triangles would fold
SOLVED = 1e-10  # residual relative to the right-hand side
STEPS = 4000
RADIUS = 0.49  # of the border's circle about (0.5, 0.5)

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Welded:
    """A mesh without duplicate vertices or flat triangles."""

    vertices: F64  # [W, 3]
    triangles: I64  # [G, 3]
    row: I64  # [V] of the welded vertex that each vertex became


def weld(vertices: Array, triangles: Array) -> Welded:
    """The mesh with vertices at the same place (float32) merged."""
    places, row = np.unique(vertices.astype(np.float32), axis=0, return_inverse=True)
    row = row.reshape(-1).astype(np.int64)
    corner = row[triangles.astype(np.int64)]
    a, b, c = corner.T
    return Welded(places.astype(np.float64), corner[(a != b) & (b != c) & (c != a)], row)


def unwrap(vertices: Array, triangles: Array, centre: int) -> F64:
    """uv [V, 2] in 0..1 of a mesh [V, 3], [F, 3] in metres, face +Z, +Y up; vertex `centre` in the middle, up upwards.

    Vertices at the same place get the same uv. Raises AvatarError for a mesh of several pieces, without a border,
    with an edge that more than two triangles share, and for vertices outside all triangles.
    """
    mesh = weld(vertices, triangles)
    if len(np.unique(mesh.triangles)) != len(mesh.vertices):
        raise AvatarError("has vertices that no triangle uses; remove them", field="vertices")
    _check_one_piece(mesh)
    loops = border_loops(mesh.triangles)
    if not loops:
        raise AvatarError("is closed: a head to unwrap needs an opening at the neck", field="triangles")
    loops.sort(key=lambda loop: -_length(mesh.vertices[loop]))
    edges, weight, size = _edges_with_lids(mesh, loops[1:])
    places, free = np.zeros((size, 2)), np.ones(size, bool)
    places[loops[0]] = _circle(mesh.vertices[loops[0]])
    free[loops[0]] = False
    places = _relaxed(edges, weight, places, free)[: len(mesh.vertices)]
    centred = _moved_to_middle(places, int(mesh.row[centre]))
    uv: F64 = 0.5 + RADIUS * _equal_rings(mesh, centred)[mesh.row]
    return uv


def border_loops(triangles: I64) -> list[I64]:
    """Loops of border vertices, each walked with the mesh on its left. Raises AvatarError if they branch."""
    directed = np.concatenate([triangles[:, [i, (i + 1) % 3]] for i in range(3)])
    size = int(triangles.max()) + 1
    key, back = directed[:, 0] * size + directed[:, 1], directed[:, 1] * size + directed[:, 0]
    if len(np.unique(key)) != len(key):
        raise AvatarError(
            "has an edge that more than two triangles share, or triangles that face both ways",
            field="triangles",
        )
    rim = directed[~np.isin(key, back)]
    if len(np.unique(rim[:, 0])) != len(rim):
        raise AvatarError("has a vertex at which two borders meet", field="triangles")
    following = dict(rim.tolist())
    loops: list[I64] = []
    while following:
        start, at = following.popitem()
        loop = [start]
        while at != start:
            loop.append(at)
            at = following.pop(at)
        loops.append(np.array(loop, np.int64))
    return loops


def _check_one_piece(mesh: Welded) -> None:
    label = np.arange(len(mesh.vertices))
    while True:
        least = label[mesh.triangles].min(axis=1)
        spread = label.copy()
        for corner in mesh.triangles.T:
            np.minimum.at(spread, corner, least)
        spread = spread[spread]
        if np.array_equal(spread, label):
            break
        label = spread
    pieces = len(np.unique(label))
    if pieces > 1:
        raise AvatarError(f"has {pieces} pieces; keep the skin alone", field="triangles")


def cotangent_edges(mesh: Welded) -> tuple[I64, F64]:
    """(edges [E, 2], weight [E]) of the mesh: half the cotangents of the angles opposite, kept positive."""
    pairs, weights = [], []
    for i in range(3):
        a, b, c = (mesh.triangles[:, (i + k) % 3] for k in range(3))
        x, y = mesh.vertices[a] - mesh.vertices[c], mesh.vertices[b] - mesh.vertices[c]
        area = np.maximum(np.linalg.norm(np.cross(x, y), axis=1), 1e-20)
        pairs.append(np.sort(np.stack([a, b], axis=1), axis=1))
        weights.append(0.5 * np.sum(x * y, axis=1) / area)
    edges, row = np.unique(np.concatenate(pairs), axis=0, return_inverse=True)
    weight = np.bincount(row.reshape(-1), np.concatenate(weights), len(edges))
    return edges, np.clip(weight, LEAST_WEIGHT, MOST_WEIGHT)


def _edges_with_lids(mesh: Welded, holes: list[I64]) -> tuple[I64, F64, int]:
    """(edges [E, 2], weight [E], number of vertices) of the mesh with a new vertex in the middle of each hole."""
    edges, weight = cotangent_edges(mesh)
    size = len(mesh.vertices)
    spokes = [np.stack([loop, np.full(len(loop), size + k)], axis=1) for k, loop in enumerate(holes)]
    count = sum(map(len, spokes))
    return np.concatenate([edges, *spokes]), np.append(weight, np.ones(count)), size + len(holes)


def _circle(loop: F64) -> F64:
    """Places of the border's vertices: by length around a circle, the foremost at the bottom, +X to the right."""
    step = np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    along = 2 * np.pi * np.concatenate([[0.0], np.cumsum(step)[:-1]]) / step.sum()
    middle = loop.mean(axis=0)
    bearing = np.arctan2(loop[:, 0] - middle[0], loop[:, 2] - middle[2])  # 0 at the front, towards +X
    offset = np.angle(np.mean(np.exp(1j * (bearing - along))))
    angle = along + offset
    circle: F64 = np.stack([np.sin(angle), -np.cos(angle)], axis=1)
    return circle


def _moved_to_middle(places: F64, row: int) -> F64:
    """Places in the unit disc by the Moebius map of the disc that takes `row` to 0 without rotation there."""
    z = places[:, 0] + 1j * places[:, 1]
    moved = (z - z[row]) / (1 - np.conj(z[row]) * z)
    return np.stack([moved.real, moved.imag], axis=1)


def _equal_rings(mesh: Welded, places: F64) -> F64:
    """Places with radii changed so that a ring has the share of the disc's area that it has of the mesh's."""
    corner = mesh.vertices[mesh.triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    radius = np.linalg.norm(places, axis=1)
    of_triangle = radius[mesh.triangles].mean(axis=1)
    order = np.argsort(of_triangle, kind="stable")
    within = np.cumsum(area[order]) / area.sum()
    at, share = np.concatenate([[0.0], of_triangle[order], [1.0]]), np.concatenate([[0.0], within, [1.0]])
    for rings in RINGS:
        known = np.linspace(0, 1, rings)
        changed = np.interp(radius, known, np.sqrt(np.interp(known, at, share)))
        result: F64 = places * (changed / np.maximum(radius, 1e-12))[:, None]
        if not folded(result, mesh.triangles).any():
            return result
    return places


def folded(uv: Array, triangles: Array) -> npt.NDArray[np.bool_]:
    """[F] whether a triangle of the plane is turned over or flat."""
    a, b, c = uv.astype(np.float64)[triangles].transpose(1, 0, 2)
    x, y = b - a, c - a
    turned: npt.NDArray[np.bool_] = x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0] <= 0
    return turned


def _relaxed(edges: I64, weight: F64, places: F64, free: npt.NDArray[np.bool_]) -> F64:
    """Places of the balance at which each free vertex is the weighted mean of its neighbours: conjugate gradients."""
    size = len(places)
    a, b = edges.T

    def pulled(x: F64) -> F64:
        """The graph Laplacian times x [size, 2]."""
        out = np.empty_like(x)
        for k in range(2):
            force = weight * (x[a, k] - x[b, k])
            out[:, k] = np.bincount(a, force, size) - np.bincount(b, force, size)
        return out

    degree = np.bincount(a, weight, size) + np.bincount(b, weight, size)
    held = np.where(free[:, None], 0.0, places)
    goal = np.where(free[:, None], -pulled(held), 0.0)
    x = np.where(free[:, None], places, 0.0)
    residual = np.where(free[:, None], goal - pulled(x), 0.0)
    search = residual / degree[:, None]
    energy = np.sum(residual * search, axis=0)
    limit = SOLVED * np.linalg.norm(goal)
    for _ in range(STEPS):
        if np.linalg.norm(residual) <= limit:
            break
        image = np.where(free[:, None], pulled(search), 0.0)
        step = energy / np.maximum(np.sum(search * image, axis=0), 1e-300)
        x += step * search
        residual -= step * image
        ready = residual / degree[:, None]
        fresh = np.sum(residual * ready, axis=0)
        search = ready + fresh / np.maximum(energy, 1e-300) * search
        energy = fresh
    return x + held


def _length(loop: F64) -> float:
    return float(np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1).sum())
