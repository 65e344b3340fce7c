"""First skin weights: heat on the skin, by conjugate gradients against a dense solution."""

from __future__ import annotations

import numpy as np

from avatar_trainer.asm.template.unwrap import cotangent_edges, weld
from avatar_trainer.asm.template.weights import CONDUCTED, LEAST, NEAREST, initial_weights, vertex_areas
from tests.measured import Measure

SIDE = 9


def test_heat_is_the_solution_of_its_linear_system(measured: Measure) -> None:
    """(L + H) w = H p of Baran and Popovic, section 4, with a matrix written out."""
    x, y = np.meshgrid(np.linspace(0, 0.1, SIDE), np.linspace(0, 0.1, SIDE))
    vertices = np.stack([x.ravel(), y.ravel(), 0.02 * np.sin(40 * x.ravel())], axis=1)
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    triangles = np.concatenate([
        np.stack([corner, corner + 1, corner + SIDE + 1], axis=1),
        np.stack([corner, corner + SIDE + 1, corner + SIDE], axis=1),
    ])  # fmt: skip
    bones = np.array([[0.01, 0.02, 0.0], [0.08, 0.03, 0.01], [0.05, 0.09, -0.01]])
    mesh = weld(vertices, triangles)
    distance = np.linalg.norm(mesh.vertices[:, None] - bones, axis=2)
    conducted = vertex_areas(mesh) * CONDUCTED / np.maximum(distance.min(axis=1), NEAREST) ** 2
    matrix = np.diag(conducted)
    for (a, b), weight in zip(*cotangent_edges(mesh), strict=True):
        matrix[[a, b], [a, b]] += weight
        matrix[[a, b], [b, a]] -= weight
    heat = np.linalg.solve(matrix, conducted[:, None] * (distance.argmin(axis=1)[:, None] == np.arange(3)))
    heat = np.maximum(heat, 0) / np.maximum(heat, 0).sum(axis=1, keepdims=True)
    heat[heat < LEAST] = 0
    heat /= heat.sum(axis=1, keepdims=True)
    worst = float(np.abs(initial_weights(vertices, triangles, bones) - heat[mesh.row]).max())
    measured("first skin weights against a dense solution", worst)
    assert worst < 1e-6
