"""A better identity of a body model whose directions move nothing: there is none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from avatar_export.bodies.body_model import BodyModel, read_body_model
from avatar_export.fit.identity import better_identity
from tests.exporter.bodies.body_files import FLAME_PARENTS, body, write_body

AWAY = np.array([0.0, 0.0, 0.05])  # metres


def model(path: Path, scale: float, count: int | None = None) -> BodyModel:
    arrays = body(FLAME_PARENTS)
    flat = arrays["v_template"] * (1, 1, 0)
    directions = np.zeros_like(arrays["identity"])
    directions[:, 2, 0] = scale
    arrays |= {"v_template": flat.astype("f4"), "identity": directions[..., :count]}
    return read_body_model(write_body(path, arrays))


@pytest.mark.parametrize("count", [None, 0], ids=["all zero", "none"])
def test_directions_that_move_nothing(count: int | None, tmp_path: Path) -> None:
    still = model(tmp_path / "body.npz", 0.0, count)
    assert better_identity(still.v_template + AWAY, still, None, {}) is None


def test_a_direction_that_explains_the_distance(tmp_path: Path) -> None:
    moving = model(tmp_path / "body.npz", 0.01)
    found = better_identity(moving.v_template + AWAY, moving, None, {})
    assert found is not None
    assert found[1][0] == pytest.approx(5, rel=0.01)
    assert found[2] < 1e-3
