"""The scanned head: mesh, colours, ARKit shapes, and small functions on its geometry."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import matrix_from_rotvec

Array = npt.NDArray[Any]
DATA = Path(__file__).parents[1] / "data"

# ICT's lips always cover the teeth, also with an open jaw; these shares of other shapes part them in jawOpen.
LIPS_OF_JAW_OPEN = {"mouthLowerDown": 0.85, "mouthUpperUp": 0.4}

# ICT's mouthClose shuts a jaw that is wide open; by itself it would lift the lips over the nose.
MOUTH_CLOSE_SHARE = 0.2

# ICT's cheekPuff hardly shows from the front.
CHEEK_PUFF_GAIN = 1.6

# Rotation of an eyeball by a full eyeLook weight, radians about (x, y): x down, y towards the subject's left.
EYE_TURN: dict[str, tuple[float, float]] = {
    "eyeLookUpLeft": (-0.30, 0.0),
    "eyeLookDownLeft": (0.36, 0.0),
    "eyeLookInLeft": (0.0, -0.5),
    "eyeLookOutLeft": (0.0, 0.5),
    "eyeLookUpRight": (-0.30, 0.0),
    "eyeLookDownRight": (0.36, 0.0),
    "eyeLookInRight": (0.0, 0.5),
    "eyeLookOutRight": (0.0, -0.5),
}


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh in metres, +Y up, +Z out of the face, +X towards the subject's left."""

    vertices: Array  # f64 [V, 3]
    triangles: Array  # i64 [F, 3], counter-clockwise from the visible side

    @cached_property
    def vertex_normals(self) -> Array:
        """Area-weighted unit normals [V, 3]."""
        corner = self.vertices[self.triangles]
        area = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        normal = np.zeros_like(self.vertices)
        for i in range(3):
            np.add.at(normal, self.triangles[:, i], area)
        return unit(normal)


@dataclass(frozen=True)
class Head(Mesh):
    """A head with colours, parts and shapes."""

    colors: Array  # f64 [V, 3], display sRGB, 0..1
    part: Array  # i64 [F], index into part_names
    part_names: tuple[str, ...]
    expression_names: tuple[str, ...]  # 51 ARKit names, all but tongueOut
    expressions: Array  # f32 [K, V, 3], metres
    identity: Array  # f32 [M, V, 3], metres for one standard deviation

    def in_part(self, *names: str) -> Array:
        """Mask of the vertices [V] that a triangle of these parts uses."""
        mask = np.zeros(len(self.vertices), bool)
        mask[self.triangles[self.triangles_in(*names)]] = True
        return mask

    def triangles_in(self, *names: str) -> Array:
        """Mask of the triangles [F] of these parts."""
        mask: Array = np.isin(self.part, [self.part_names.index(n) for n in names])
        return mask

    def expression(self, name: str) -> Array:
        """Offsets [V, 3] of one ARKit shape at full weight."""
        offsets: Array = self.expressions[self.expression_names.index(name)]
        return offsets

    @cached_property
    def eye_centres(self) -> Array:
        """Centres [2, 3] of the left and right eyeball: the sphere nearest to it."""
        centres = []
        for name in ("left_eye", "right_eye"):
            x = self.vertices[self.in_part(name)]
            system = np.c_[2 * x, np.ones(len(x))]
            centres.append(np.linalg.lstsq(system, (x**2).sum(axis=1), rcond=None)[0][:3])
        return np.array(centres)


def unit(x: Array) -> Array:
    """Rows of x, divided by their length."""
    result: Array = x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-12)
    return result


def smoothstep(x: Array, start: float, end: float) -> Array:
    """0 before start, 1 after end, smooth between; start may be larger than end."""
    t = np.clip((x - start) / (end - start), 0, 1)
    result: Array = t * t * (3 - 2 * t)
    return result


def neck_height(vertices: Array) -> Array:
    """Height [V] in metres across the neck, which leans forward.

    Chin, jaw and skull lie above -0.065, throat and nape below.
    """
    height: Array = vertices[:, 1] + 0.8 * vertices[:, 2]
    return height


def smooth_over_mesh(head: Head, values: Array, rounds: int) -> Array:
    """Vertex values averaged `rounds` times with those of their neighbours."""
    edges = np.concatenate([head.triangles[:, [i, j]] for i in range(3) for j in range(3) if i != j])
    degree = np.maximum(np.bincount(edges[:, 0], minlength=len(values)), 1)
    for _ in range(rounds):
        values = 0.5 * values + 0.5 * np.bincount(edges[:, 0], values[edges[:, 1]], len(values)) / degree
    return values


def load_head() -> Head:
    """The head of samples/data, centimetres turned into metres."""
    with np.load(DATA / "head.npz", allow_pickle=False) as file:
        data = {name: file[name] for name in file.files}
    ptr = data["expression_ptr"]
    expressions = np.zeros((len(ptr) - 1, *data["vertices"].shape), np.float32)
    for k, shape in enumerate(expressions):
        rows = slice(ptr[k], ptr[k + 1])
        shape[data["expression_index"][rows]] = data["expression_offset"][rows].astype(np.float32) / 100
    names = tuple(data["expression_names"].tolist())
    for lips, share in LIPS_OF_JAW_OPEN.items():
        for side in ("Left", "Right"):
            expressions[names.index("jawOpen")] += share * expressions[names.index(lips + side)]
    expressions[names.index("mouthClose")] *= MOUTH_CLOSE_SHARE
    expressions[names.index("cheekPuff")] *= CHEEK_PUFF_GAIN
    return Head(
        vertices=data["vertices"].astype(np.float64) / 100,
        colors=data["colors"].astype(np.float64) / 255,
        triangles=data["triangles"].astype(np.int64),
        part=data["part"].astype(np.int64),
        part_names=tuple(data["part_names"].tolist()),
        expression_names=names,
        expressions=expressions,
        identity=data["identity"].astype(np.float32) / 100,
    )


def part_of(head: Head, rows: Array, triangles: Array, part: Array) -> Head:
    """The vertices `rows`; `triangles` [F, 3] index them, `part` [F] is theirs."""
    return replace(
        head,
        vertices=head.vertices[rows],
        colors=head.colors[rows],
        triangles=triangles,
        part=part,
        expressions=head.expressions[:, rows],
        identity=head.identity[:, rows],
    )


def simplify(head: Head, cell: float) -> Head:
    """A coarse copy: one vertex for each cube of `cell` metres and part, triangles that collapse dropped."""
    part_of_vertex = np.zeros(len(head.vertices), np.int64)
    part_of_vertex[head.triangles] = head.part[:, None]
    key = np.c_[part_of_vertex, np.floor(head.vertices / cell).astype(np.int64)]
    _, chosen, cluster = np.unique(key, axis=0, return_index=True, return_inverse=True)
    triangles = cluster.reshape(-1)[head.triangles]
    a, b, c = triangles.T
    kept = (a != b) & (b != c) & (c != a)
    used, flat = np.unique(triangles[kept], return_inverse=True)
    return part_of(head, chosen[used], flat.reshape(-1, 3), head.part[kept])


def turned_eyes(head: Head) -> Head:
    """A copy whose eyeLook shapes carry the eyeballs along a chord of the turn: a rig without eye joints."""
    expressions = head.expressions.copy()
    for name, (x, y) in EYE_TURN.items():
        side = 0 if name.endswith("Left") else 1
        ball = head.in_part(("left_eye", "right_eye")[side])
        arm = head.vertices[ball] - head.eye_centres[side]
        turn = matrix_from_rotvec(np.array([x, y, 0.0]))
        expressions[head.expression_names.index(name), ball] = arm @ turn.T - arm
    return replace(head, expressions=expressions)
