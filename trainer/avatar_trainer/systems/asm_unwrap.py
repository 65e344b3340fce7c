"""An unwrap of a head: one place in the plane for each vertex, no triangle folded over another.

Texture coordinates of game meshes have seams, mirrored and overlapping charts; mixtures in the plane (ASM, Eq. 4)
would jump or leak there. Here vertices at the same place count as one, the longest border (the neck's) becomes a
circle, and every other vertex the weighted mean of its neighbours: with positive weights such a map folds nothing
(Tutte 1963, Floater 1997). Weights are those of springs, stiffened where they are stretched and softened where they
are pressed together (after Yoshizawa et al. 2004), so that areas come near their share of the head.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F64, I64
from avatar_runtime.errors import AvatarError

ROUNDS = 12  # of stiffening
PULL = 0.7  # power of an edge's stretch that its spring is stiffened by
FRONT_GAIN = 1.6  # how much longer edges on the front are than their share
SOLVED = 1e-10  # residual relative to the right-hand side
STEPS = 4000
RADIUS = 0.49  # of the border's circle about (0.5, 0.5)

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Welded:
    """A mesh without doubled vertices or flat triangles."""

    vertices: F64  # [W, 3]
    triangles: I64  # [G, 3]
    row: I64  # [V] of the welded vertex that each vertex became


def weld(vertices: Array, triangles: Array) -> Welded:
    """The mesh with vertices at the same place (float32) made one."""
    places, row = np.unique(vertices.astype(np.float32), axis=0, return_inverse=True)
    row = row.reshape(-1).astype(np.int64)
    corner = row[triangles.astype(np.int64)]
    a, b, c = corner.T
    return Welded(places.astype(np.float64), corner[(a != b) & (b != c) & (c != a)], row)


def unwrap(vertices: Array, triangles: Array) -> F64:
    """uv [V, 2] in 0..1 of a mesh [V, 3], [F, 3] in metres, face +Z, +Y up: the front in the middle, up upwards.

    Vertices at the same place get the same uv. Raises AvatarError for a mesh of several pieces, without a border, or
    with an edge that more than two triangles share.
    """
    mesh = weld(vertices, triangles)
    if len(np.unique(mesh.row[triangles])) != len(mesh.vertices):
        raise AvatarError(
            "has vertices that no triangle uses; remove them", field=f"triangles [{len(triangles)}, 3]"
        )
    loops = border_loops(mesh.triangles)
    _check_one_piece(mesh)
    if not loops:
        raise AvatarError("is closed: a head to unwrap needs an opening at the neck", field="triangles")
    loops.sort(key=lambda loop: -_length(mesh.vertices[loop]))
    edges, size = _edges_with_lids(mesh, loops[1:])
    rim = np.concatenate([loops[0]])
    places = np.zeros((size, 2))
    places[rim] = _circle(mesh.vertices[rim])
    target = _target_lengths(mesh, edges)
    free = np.ones(size, bool)
    free[rim] = False
    stiffness = np.ones(len(edges))
    for _ in range(ROUNDS):
        places = _relaxed(edges, stiffness, places, free)
        length = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1) / target
        stiffness *= np.maximum(length / np.mean(length), 1e-3) ** PULL
        stiffness /= np.mean(stiffness)
    places = _relaxed(edges, stiffness, places, free)
    uv: F64 = places[mesh.row]
    return uv


def border_loops(triangles: I64) -> list[I64]:
    """Loops of border vertices, each walked with the mesh on its left. Raises AvatarError where they branch."""
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


def _edges_with_lids(mesh: Welded, holes: list[I64]) -> tuple[I64, int]:
    """(edges [E, 2], number of vertices) of the mesh with one vertex more in the middle of each hole."""
    size = len(mesh.vertices)
    pairs = [mesh.triangles[:, [i, (i + 1) % 3]] for i in range(3)]
    for k, loop in enumerate(holes):
        pairs.append(np.stack([loop, np.full(len(loop), size + k)], axis=1))
    edges = np.unique(np.sort(np.concatenate(pairs), axis=1), axis=0)
    return edges, size + len(holes)


def _circle(loop: F64) -> F64:
    """Places of the border's vertices: by length around a circle, the foremost at the bottom, +X to the right."""
    step = np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    along = 2 * np.pi * np.concatenate([[0.0], np.cumsum(step)[:-1]]) / step.sum()
    middle = loop.mean(axis=0)
    bearing = np.arctan2(loop[:, 0] - middle[0], loop[:, 2] - middle[2])  # 0 at the front, towards +X
    offset = np.angle(np.mean(np.exp(1j * (bearing - along))))
    angle = along + offset
    return 0.5 + RADIUS * np.stack([np.sin(angle), -np.cos(angle)], axis=1)


def _target_lengths(mesh: Welded, edges: I64) -> F64:
    """The lengths that edges would have, metres; those of lids and slivers at least a hundredth of the mean."""
    size = edges.max() + 1
    place = np.concatenate([mesh.vertices, np.zeros((size - len(mesh.vertices), 3))])
    for k in range(len(mesh.vertices), size):
        place[k] = mesh.vertices[edges[edges[:, 1] == k][:, 0]].mean(axis=0)
    length = np.linalg.norm(place[edges[:, 0]] - place[edges[:, 1]], axis=1)
    middle = 0.5 * (place.min(axis=0) + place.max(axis=0))
    depth = (place[edges, 2].mean(axis=1) - middle[2]) / max(place[:, 2].max() - middle[2], 1e-12)
    gain = 1 + (FRONT_GAIN - 1) * np.clip(depth / 0.6, 0, 1)
    target: F64 = np.maximum(length, 0.01 * length.mean()) * gain
    return target


def _relaxed(edges: I64, stiffness: F64, places: F64, free: npt.NDArray[np.bool_]) -> F64:
    """Places of the springs' balance with the vertices that are not free held: conjugate gradients."""
    size = len(places)
    a, b = edges.T

    def pulled(x: F64) -> F64:
        """The springs' graph Laplacian times x [size, 2]."""
        out = np.empty_like(x)
        for k in range(2):
            force = stiffness * (x[a, k] - x[b, k])
            out[:, k] = np.bincount(a, force, size) - np.bincount(b, force, size)
        return out

    degree = np.bincount(a, stiffness, size) + np.bincount(b, stiffness, size)
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
