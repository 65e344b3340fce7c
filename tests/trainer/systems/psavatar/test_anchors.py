"""Places off a mesh against the roots of a cubic: every triangle's normals, all of their places."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_trainer.normals import vertex_normals
from avatar_trainer.systems.psavatar.anchors import PER_METRE, REACH, anchored
from tests.trainer.systems.splatting_avatar import scene as sheet

Array = npt.NDArray[Any]
COUNT = 24
ROUNDING = 1e-6  # metres: the search ends when it is ten times as near


@pytest.fixture(scope="module")
def mesh() -> tuple[Array, Array, Array]:
    """(vertices, vertex normals, triangles) of three bent sheets, one behind the other."""
    body = sheet.body()
    one, triangles = body["v_template"].astype(np.float64), body["triangles"].astype(np.int64)
    vertices = np.concatenate([one, one * (1, -1, 1) - (0, 0, 0.03), one - (0.01, 0, 0.05)])
    mirrored = triangles[:, ::-1] + len(one)
    triangles = np.concatenate([triangles, mirrored, triangles + 2 * len(one)])
    return vertices, vertex_normals(vertices, triangles), triangles


def through(x: Array, corner: Array, normal: Array) -> list[tuple[float, Array]]:
    """(d, weights) of every d within reach at which x lies in the triangle of the corners v_k + d n_k."""

    def volume(d: float) -> float:
        return float(np.linalg.det(corner + d * normal - x))

    at = np.linspace(0, REACH, 4)
    found = []
    for root in np.roots(np.polyfit(at, [volume(d) for d in at], 3)):
        if abs(root.imag) < 1e-9 and 0 < root.real <= REACH:
            raised = corner + root.real * normal
            system = np.vstack([raised.T, np.ones(3)])
            weights, *_ = np.linalg.lstsq(system, np.append(x, 1), rcond=None)
            if weights.min() >= 0 and np.linalg.norm(system @ weights - np.append(x, 1)) < ROUNDING:
                found.append((float(root.real), weights))
    return found


def test_places_are_held_by_the_steadiest_triangle(mesh: tuple[Array, Array, Array]) -> None:
    vertices, normals, triangles = mesh
    rng = np.random.default_rng(3)
    moved, turned = rng.uniform(0, 4e-3, len(triangles)), rng.uniform(0, 0.3, len(triangles))
    place = np.c_[rng.uniform(-0.08, 0.08, (COUNT, 2)), rng.uniform(0.03, 0.12, COUNT)]
    found = anchored(place, vertices, normals, triangles, moved, turned)
    several = 0
    for i, x in enumerate(place):
        swings = {}
        for f, corners in enumerate(triangles):
            for d, _ in through(x, vertices[corners], normals[corners]):
                swings[f] = min(moved[f] + d * (turned[f] + PER_METRE), swings.get(f, np.inf))
        several += len(swings) > 1
        if not swings:
            assert found.triangle[i] < 0
            continue
        f, d = int(found.triangle[i]), found.distance[i]
        raised = vertices[triangles[f]] + d * normals[triangles[f]]
        assert found.barycentric[i] @ raised == pytest.approx(x, abs=ROUNDING)
        assert found.barycentric[i].min() >= 0 and found.barycentric[i].sum() == pytest.approx(1)
        assert moved[f] + d * (turned[f] + PER_METRE) == pytest.approx(min(swings.values()), rel=1e-4)
    assert several > COUNT / 2  # there is something to choose
