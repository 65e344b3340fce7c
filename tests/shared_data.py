"""The folder of optional large test data: the one that AVATAR_TEST_DATA names, else one beside the checkout."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def shared(relative: str) -> Path:
    """The path of a file of the optional test data; skips the test where it is absent."""
    base = Path(os.environ.get("AVATAR_TEST_DATA", ROOT.parent / "shared" / "data"))
    path = base / relative
    if not path.exists():
        pytest.skip(f"optional test data {relative} is not here (set AVATAR_TEST_DATA)")
    return path
