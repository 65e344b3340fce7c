"""The nearest point of a mesh: against every triangle by trimesh in float64, and gradients by differences."""

from __future__ import annotations

import numpy as np
import pytest
import torch
import trimesh

from avatar_runtime.avatar import F64, I64
from avatar_trainer.asm.kernels.closest import nearest, point_to_surface, triangle_tree
from tests.measured import Measure

FLAT = 1e-6  # areas below


def soup(triangles: int, seed: int) -> tuple[F64, I64]:
    """Triangles anywhere in a box, some of them slivers, lines and points, some stored twice."""
    random = np.random.default_rng(seed)
    vertices = random.uniform(-1, 1, (triangles, 3, 3))
    vertices[: triangles // 2] = (
        vertices[: triangles // 2, :1] + random.normal(size=(triangles // 2, 3, 3)) * 0.05
    )
    vertices[0, 2] = vertices[0, 1]
    vertices[1] = vertices[1, :1]
    vertices[2, 2] = (vertices[2, 0] + vertices[2, 1]) / 2
    vertices[3, 2] = vertices[3, 0] + (vertices[3, 1] - vertices[3, 0]) * 0.3 + 1e-9
    rows = np.arange(3 * triangles).reshape(-1, 3)
    return vertices.reshape(-1, 3), np.concatenate([rows, rows[:20]])


def points_about(vertices: F64, count: int, seed: int) -> F64:
    """Points near and far, on vertices, and in the middle of edges."""
    random = np.random.default_rng(seed)
    near = vertices[random.integers(0, len(vertices), count)] + random.normal(size=(count, 3)) * 0.02
    edges = (vertices[0::3][:20] + vertices[1::3][:20]) / 2
    return np.concatenate([near, random.normal(size=(count, 3)) * 3, vertices[:20], edges])


def by_every_triangle(points: F64, vertices: F64, triangles: I64) -> F64:
    """Distances [N] by trimesh; to triangles without area, which it does not take, by their edges."""
    corner = vertices[triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    sound, flat = corner[area > FLAT], corner[area <= FLAT]
    found = []
    for point in points:
        at = trimesh.triangles.closest_point(sound, np.broadcast_to(point, (len(sound), 3)))
        apart = np.linalg.norm(at - point, axis=1).min()
        for a, b in ((0, 1), (1, 2), (2, 0)):
            edge = flat[:, b] - flat[:, a]
            length = np.maximum((edge**2).sum(axis=1), 1e-300)
            share = np.clip(((point - flat[:, a]) * edge).sum(axis=1) / length, 0, 1)
            off = flat[:, a] + share[:, None] * edge - point
            apart = np.linalg.norm(off, axis=1).min(initial=apart)
        found.append(apart)
    return np.array(found)


@pytest.mark.parametrize("triangles", [5, 37, 400])
def test_distances_are_those_of_a_search_through_every_triangle(triangles: int, measured: Measure) -> None:
    vertices, rows = soup(triangles, triangles)
    points = points_about(vertices, 60, 1)
    found = nearest(points, vertices, triangle_tree(vertices, rows))
    expected = by_every_triangle(points, vertices, rows)
    off = np.abs(np.sqrt(found.squared_distance) - expected)
    assert off.max() < 1e-8  # a sliver is taken for its edges
    measured("nearest point of triangles against trimesh, sizes of 1", float(off.max()))


def test_gradients_are_those_of_differences() -> None:
    vertices, rows = soup(40, 8)
    tree = triangle_tree(vertices, rows)
    random = np.random.default_rng(9)
    points = torch.tensor(random.uniform(-1, 1, (25, 3)), requires_grad=True)
    places = torch.tensor(vertices, requires_grad=True)
    weight = torch.tensor(random.normal(size=25))

    def total(p: torch.Tensor, v: torch.Tensor) -> torch.Tensor:
        return (point_to_surface(p, v, tree)[0] * weight).sum()

    assert torch.autograd.gradcheck(total, (points, places), eps=1e-6, atol=1e-6)


def test_a_callers_mistakes_are_refused() -> None:
    vertices, rows = soup(10, 1)
    tree = triangle_tree(vertices, rows)
    with pytest.raises(ValueError, match="F > 0"):
        triangle_tree(vertices, rows[:0])
    with pytest.raises(ValueError, match="beyond the 30"):
        triangle_tree(vertices, rows + 1)
    with pytest.raises(ValueError, match=r"points \(3,\)"):
        nearest(vertices[0], vertices, tree)
    with pytest.raises(ValueError, match="beyond the 4"):
        nearest(vertices, vertices[:4], tree)
    with pytest.raises(ValueError, match="finite"):
        nearest(vertices * np.nan, vertices, tree)
    with pytest.raises(ValueError, match="guess"):
        nearest(vertices, vertices, tree, np.full(len(vertices), len(rows)))
    with pytest.raises(ValueError, match="do not go together"):
        point_to_surface(torch.zeros(1, 3), torch.tensor(vertices), tree)
