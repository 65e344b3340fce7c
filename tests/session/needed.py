"""Tools that a test cannot do without."""

from __future__ import annotations

import os
from collections.abc import Mapping

import pytest


def need(tools: Mapping[str, object]) -> None:
    """In CI a missing tool fails the test; elsewhere it skips it, with the tool's name."""
    missing = " and ".join(name for name, there in tools.items() if not there)
    if missing and os.environ.get("CI"):
        pytest.fail(f"{missing}: missing; `make test` installs it", pytrace=False)
    if missing:
        pytest.skip(f"{missing}: missing")
