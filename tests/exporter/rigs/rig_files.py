"""A small morphed character on three joints as a .glb in every form exporters give it, and where its vertices are.

The surface is one; a form says how the file splits it into parts, copies and reorders vertices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.exporter.bodies.body_files import COLUMNS, ROWS, sheet
from tests.exporter.glb_files import Builder

Array = npt.NDArray[Any]

JOINTS = ("hip", "neck", "head")
PLACES = np.array([[0.4, 0.1, 0.0], [0.4, 0.5, 0.02], [0.42, 0.7, 0.0]])  # metres, at rest; a chain
MORPHS = ("AK_25_JawOpen", "smile")
FPS, FRAMES = 24, 13  # keys of the clip
ANGLE = np.radians(60)
LYING = np.array([[100, 0, 0, 0], [0, 0, -100, 0], [0, 100, 0, 0], [0, 0, 0, 1.0]])  # centimetres, Z up


def vertices() -> Array:
    """[63, 3] metres."""
    row, column = np.divmod(np.arange(ROWS * COLUMNS), COLUMNS)
    x, y = 0.1 * column + 0.013 * np.sin(row), 0.15 * row + 0.017 * np.cos(2.0 * column)
    return np.stack([x, y, 0.05 * np.sin(3 * x + 2 * y)], axis=1).astype("<f4")


def weights() -> Array:
    """[63, 3] of JOINTS."""
    y = vertices()[:, 1, None] - np.array([0.1, 0.5, 0.8])
    near = np.exp(-((y / 0.2) ** 2)).astype(np.float64)
    near[near < 0.02] = 0
    return near / near.sum(axis=1, keepdims=True)


def morphs() -> Array:
    """[2, 63, 3] metres; mostly zero."""
    rng = np.random.default_rng(4)
    offsets = np.zeros((2, ROWS * COLUMNS, 3), "<f4")
    offsets[0, 40:58] = rng.normal(0, 0.02, (18, 3))
    offsets[1, 50:] = rng.normal(0, 0.02, (13, 3))
    return offsets


def posed(angle: float, weight: float) -> Array:
    """[63, 3] with the head turned about +Z and the first morph at `weight`, vertex by vertex."""
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])
    result = np.zeros((ROWS * COLUMNS, 3))
    for v, point in enumerate(vertices() + weight * morphs()[0]):
        moved = turn @ (point - PLACES[2]) + PLACES[2]
        result[v] = (weights()[v, 0] + weights()[v, 1]) * point + weights()[v, 2] * moved
    return result


@dataclass(frozen=True)
class Part:
    """A primitive: which vertices of the character it stores, in its order, and triangles of these."""

    rows: Array
    triangles: Array


def whole() -> list[Part]:
    return [Part(np.arange(ROWS * COLUMNS), sheet())]


def split(seed: int = 2) -> list[Part]:
    """Two parts with vertices of their own along the seam, everything shuffled."""
    rng = np.random.default_rng(seed)
    triangles = rng.permutation(sheet())
    return [_part(triangles[:50], rng), _part(triangles[50:], rng)]


def soup(seed: int = 3) -> list[Part]:
    """Every triangle has three vertices of its own."""
    triangles = np.random.default_rng(seed).permutation(sheet())
    return [Part(triangles.reshape(-1), np.arange(triangles.size).reshape(-1, 3))]


def _part(triangles: Array, rng: np.random.Generator) -> Part:
    rows = rng.permutation(np.unique(triangles))
    local = np.zeros(ROWS * COLUMNS, int)
    local[rows] = np.arange(len(rows))
    return Part(rows, local[triangles])


def shuffled(points: Array, triangles: Array | None = None, seed: int = 6) -> tuple[Array, Array, Array]:
    """(vertices, triangles, row of each in `points`): the same surface in another order, as another tool writes it."""
    triangles = sheet() if triangles is None else triangles
    rng = np.random.default_rng(seed)
    order = rng.permutation(np.unique(triangles))
    local = np.zeros(len(points), int)
    local[order] = np.arange(len(order))
    triangles = local[rng.permutation(triangles)]
    turn = rng.integers(0, 3, (len(triangles), 1))
    turned = np.take_along_axis(triangles, (turn + np.arange(3)) % 3, axis=1)
    return points[order].astype(np.float32), turned.astype(np.uint32), order


def rig_glb(
    parts: Sequence[Part] | None = None,
    *,
    ids: str | None = None,  # "attribute", "uv" or "flipped": how vertex ids are given
    nodes: bool = False,  # a node and mesh for each part, instead of a primitive
    shared: bool = False,  # all parts index the vertices of the first
    lying: bool = False,  # stored in centimetres, Z up; only the nodes stand
    animated: float = 1,
) -> bytes:
    build = Builder()
    parts = whole() if parts is None else parts
    store = LYING if lying else np.eye(4)
    primitives: list[dict[str, Any]] = []
    for part in parts:
        primitive = dict(primitives[0]) if shared and primitives else _vertices(build, part.rows, store, ids)
        primitives.append(primitive | {"indices": build.add(part.triangles.reshape(-1), "SCALAR", "<u2")})
    groups = [[primitive] for primitive in primitives] if nodes else [primitives]
    local = np.diff(PLACES, axis=0, prepend=0).tolist()
    bones = [
        {"name": name, "translation": at, "children": [i + 1][: 2 - i]}
        for i, (name, at) in enumerate(zip(JOINTS, local, strict=True))
    ]
    bind = np.tile(np.eye(4), (3, 1, 1))
    bind[:, :3, 3] = -PLACES
    inverse = build.add((bind @ np.linalg.inv(store)).transpose(0, 2, 1), "MAT4", "<f4")
    build.document |= {
        "meshes": [{"primitives": group, "extras": {"targetNames": list(MORPHS)}} for group in groups],
        "nodes": [*bones, *({"name": f"part{i}", "mesh": i, "skin": 0} for i in range(len(groups)))],
        "scenes": [{"nodes": [0, *range(3, 3 + len(groups))]}],
        "skins": [{"joints": [0, 1, 2], "inverseBindMatrices": inverse}],
    }
    if animated:
        build.document["animations"] = [_nod(build, animated)]
    return build.data()


def _vertices(build: Builder, rows: Array, store: Array, ids: str | None) -> dict[str, Any]:
    share = np.concatenate([weights()[rows], np.zeros((len(rows), 1))], axis=1)
    attributes = {
        "POSITION": build.add(vertices()[rows] @ store[:3, :3].T, "VEC3", "<f4"),
        "JOINTS_0": build.add(np.tile([0, 1, 2, 0], (len(rows), 1)), "VEC4", "u1"),
        "WEIGHTS_0": build.add(share, "VEC4", "<f4"),
    }
    if ids == "attribute":
        attributes["_VERTEX_ID"] = build.add(rows, "SCALAR", "<f4")
    elif ids:
        uv = np.stack([rows % 256, 2 + rows // 256], axis=1)
        uv[:, 1] = 1 - uv[:, 1] if ids == "flipped" else uv[:, 1]
        attributes["TEXCOORD_0"] = build.add(uv, "VEC2", "<f4")
    targets = [
        {"POSITION": build.add(offset @ store[:3, :3].T, "VEC3", "<f4")} for offset in morphs()[:, rows]
    ]
    return {"attributes": attributes, "targets": targets}


def _nod(build: Builder, most: float) -> dict[str, Any]:
    """The head turns by ANGLE about +Z, linearly in angle, while the first morph rises to `most`."""
    half = np.linspace(0, ANGLE, FRAMES) / 2
    turn = np.stack([0 * half, 0 * half, np.sin(half), np.cos(half)], axis=1)
    rise = np.stack([np.linspace(0, most, FRAMES), np.zeros(FRAMES)], axis=1)
    times = build.add(np.arange(FRAMES) / FPS, "SCALAR", "<f4")
    outputs = (build.add(turn, "VEC4", "<f4"), build.add(rise.reshape(-1), "SCALAR", "<f4"))
    targets = ({"node": 2, "path": "rotation"}, {"node": 3, "path": "weights"})
    return {
        "name": "nod",
        "samplers": [{"input": times, "output": output} for output in outputs],
        "channels": [{"sampler": i, "target": target} for i, target in enumerate(targets)],
    }
