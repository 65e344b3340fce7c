"""The scanned head: the shape and the colours of a person on the mesh of the head model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.head import EYE_TURN, Head, head_of, part_of

DATA = Path(__file__).parents[1] / "data"
MODES = 8  # identity modes of the head model that the samples know


def load_head() -> Head:
    """The head of samples/data."""
    with np.load(DATA / "head.npz", allow_pickle=False) as file:
        return head_of(file["vertices"], file["colors"], MODES)


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
