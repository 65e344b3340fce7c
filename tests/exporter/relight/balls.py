"""A ball whose normals are known, coloured as one likes."""

from __future__ import annotations

import numpy as np

from avatar_export.ops.surfels import RULES, surfels
from avatar_runtime.avatar import Avatar, Blendshapes, Group, SparseRows
from avatar_runtime.checks.avatar import check_avatar
from tests.avatars import surface_avatar
from tests.golden import Array

RADIUS = 0.1  # metres


def sphere(rows: int = 24) -> tuple[Array, Array]:
    """(vertices, triangles) of a closed ball, seen from outside counter-clockwise."""
    columns = 2 * rows
    polar, turn = np.linspace(0, np.pi, rows + 1), np.arange(columns) * 2 * np.pi / columns
    ring = np.stack([np.cos(turn), np.zeros(columns), np.sin(turn)], axis=1)
    vertices = np.concatenate([np.sin(p) * ring + (0, np.cos(p), 0) for p in polar])
    k, j = np.mgrid[:rows, :columns]
    a, b = k * columns + j, k * columns + (j + 1) % columns
    quads = np.stack([a, b, b + columns, a + columns], axis=-1).reshape(-1, 4)
    return RADIUS * vertices, np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])


def ball(colour: Array | None = None, mesh: tuple[Array, Array] | None = None) -> Avatar:
    """Gaussians of display-referred `colour` [V, 3] on a mesh without a rig."""
    vertices, triangles = sphere() if mesh is None else mesh
    colour = np.full(vertices.shape, 0.5) if colour is None else colour
    kinds = (vertices, np.float32), (triangles, np.uint32), (colour, np.float32)
    gaussians, embedding = surfels(*(values.astype(kind) for values, kind in kinds))
    n, mean = gaussians.count, {"mean": (3,)}
    look = {"log_scale": (3,), "opacity_logit": (), "sh": (1, 3)}
    shapes = (mean | {"quat_wxyz": (4,)}, look, mean, mean)
    return check_avatar(
        Avatar(
            name="ball",
            gaussians=gaussians,
            groups=(Group("ball", 0, n, "surface"),),
            rules=RULES,
            expressions=(),
            eyelids=(),
            blendshapes=Blendshapes(*(SparseRows.empty(n, 0, shape) for shape in shapes)),
            skin=SparseRows.empty(n, 0, {"weight": ()}),
            rig=None,
            sh_degree=0,
            embedding=embedding,
            provenance=surface_avatar().provenance,
        )
    )
