"""What a worker of pytest-xdist sends of the figures that its tests measured."""

from __future__ import annotations

import numpy as np
import pytest

from tests import measured


def test_figures_are_plain_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """execnet sends no NumPy number: the worker would end with an error."""
    for table in ("_WORST", "_LIMITS"):
        monkeypatch.setattr(measured, table, {})
    measured.note("a figure", np.float64(1), np.float64(2))
    assert {type(value) for table in (measured._WORST, measured._LIMITS) for value in table.values()} == {
        float
    }
