"""Golden packs of every version of the format load, are sound, and play as they did when they were written."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from avatar_export.checks.pack import validate_pack
from avatar_runtime.bundle import load
from tests.exporter.packing.golden import ARRAYS, DATA, played

PACKS = sorted(DATA.glob("*/*.avatar"))
ROUNDINGS = 64  # of float32 at an array's largest value, as in test_released


@pytest.mark.parametrize("path", PACKS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_a_golden_pack_plays_as_it_did(path: Path) -> None:
    assert [problem for problem in validate_pack(path) if not problem.warning] == []
    found = played(load(path))
    with np.load(path.with_suffix(".npz")) as want:
        for name in ARRAYS:
            limit = ROUNDINGS * np.finfo(np.float32).eps * max(np.abs(want[name]).max(), 1e-6)
            assert found[name].shape == want[name].shape, name
            assert np.abs(found[name] - want[name]).max() <= limit, name
