"""The known changes: which of them explains a misfit, and which never do."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_export.fit.known import UNITS, Change, rotations, unit_of
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
    faces = np.concatenate(
        [
            np.stack([first, first + 1, first + 32], axis=1),
            np.stack([first + 1, first + 33, first + 32], axis=1),
        ]
    )
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


def test_nothing_is_found_where_nothing_is_wrong() -> None:
    for noise in (0.0, 3e-3, 2e-2):
        points = POINTS + np.random.default_rng(1).normal(0, 1, POINTS.shape) * noise
        assert explained(points, MESH, 0.05 * size_of(MESH.vertices), pairs=True) is None


def test_a_factor_that_is_no_unit_is_not_invented() -> None:
    mesh = Mesh(1.4 * MESH.vertices, MESH.triangles)
    assert explained(POINTS, mesh, 0.05 * size_of(mesh.vertices), pairs=False) is None


def test_rotations_and_units() -> None:
    turned = list(rotations())
    assert len(turned) == 47 and len({change.axes for change in turned}) == 47
    assert [change.mirrors for change in turned] == [False] * 23 + [True] * 24
    assert [unit_of(factor) for factor in UNITS] == list(UNITS.values())
    assert unit_of(7.0) is None
