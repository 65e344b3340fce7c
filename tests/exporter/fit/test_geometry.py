"""The nearest points of a mesh against trimesh; which known change explains a misfit, and which never does."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from avatar_export.fit.closest import Triangles
from avatar_export.fit.known import Change, rotations
from avatar_export.fit.surface import Mesh, explained, size_of
from avatar_runtime.avatar import F64

TURN = next(change for change in rotations() if change.axes == "x, -z, y")


def _egg() -> tuple[Mesh, F64]:
    """An uneven closed surface of about a head's size, and points near it."""
    random = np.random.default_rng(6)
    u, v = np.meshgrid(np.linspace(0, np.pi, 24), np.linspace(0, 2 * np.pi, 32), indexing="ij")
    radius = 0.12 + 0.03 * np.sin(3 * u + 1) * np.cos(v) + 0.02 * np.cos(u)
    ball = np.stack([np.sin(u) * np.cos(v), 1.5 * np.cos(u), np.sin(u) * np.sin(v)], axis=-1)
    vertices = (radius[..., None] * ball).reshape(-1, 3)
    row, column = np.divmod(np.arange(23 * 31), 31)
    first = 32 * row + column
    faces = first[:, None] + np.array([[[0, 1, 32]], [[1, 33, 32]]])
    faces = faces.reshape(-1, 3)
    points = vertices[random.integers(0, len(vertices), 400)] + random.normal(0, 1e-3, (400, 3))
    return Mesh(vertices, faces.astype(np.uint32)), points


MESH, POINTS = _egg()
CHANGES = {
    "millimetres": Change(scale=1000.0),
    "inches": Change(scale=1 / 0.0254),
    "kilometres": Change(scale=1e-3),
    "axes": TURN,
    "shift": Change(shift=(0.3, 0.0, 0.1)),
    "small shift": Change(shift=(0.03, 0.0, 0.0)),
    "unit and axes": Change(100.0, TURN.rotation),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_known_change_is_found(name: str) -> None:
    change = CHANGES[name]
    mesh = Mesh(change.of(MESH.vertices), MESH.triangles)
    found = explained(POINTS, mesh, 0.05 * size_of(mesh.vertices), pairs=True)
    assert found is not None
    got, median = found
    assert got.scale == change.scale and (got.turns == change.turns)
    np.testing.assert_allclose(got.shift, np.array(change.shift), atol=4e-3)
    assert median < 4e-3 * change.scale


SCALES = (1e-3, 1.0, 1e3)


def _mesh(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A ball with uneven triangles, one of them without area."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    vertices = ball.vertices * np.random.default_rng(seed).uniform(0.2, 1.5, (len(ball.vertices), 1))
    faces = np.vstack([ball.faces, [[5, 5, 9]]])
    return vertices, faces.astype(np.uint32)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("away", [0.0, 200.0])
def test_distances_and_places(scale: float, away: float) -> None:
    vertices, faces = _mesh(3)
    points = np.random.default_rng(4).normal(0, 1, (300, 3)) + away
    found = Triangles.of(scale * vertices, faces).nearest(scale * points)
    plain = trimesh.Trimesh(vertices, faces[:-1], process=False)
    _, want, _ = trimesh.proximity.closest_point_naive(plain, points)
    tolerance = 64 * np.finfo(np.float64).eps * scale * (2 + away)
    np.testing.assert_allclose(found.distance, scale * want, atol=tolerance, rtol=0)
    places = np.einsum("ij,ijk->ik", found.barycentric, scale * vertices[faces[found.triangle]])
    np.testing.assert_allclose(
        np.linalg.norm(scale * points - places, axis=1), found.distance, atol=tolerance
    )
    assert (found.barycentric > -1e-12).all()
