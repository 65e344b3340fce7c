"""Tools that a test cannot do without."""

from __future__ import annotations

import os
from collections.abc import Mapping

import pytest


def need(tools: Mapping[str, object]) -> None:
    """In CI a missing tool fails the test, so no skip hides there. Elsewhere it skips the test, with the tool's name: a
    checkout without browsers, compilers or root still tests the rest."""
    missing = " and ".join(name for name, there in tools.items() if not there)
    if missing and os.environ.get("CI"):
        pytest.fail(f"{missing}: missing; CI must have it (see .ci/packages)", pytrace=False)
    if missing:
        pytest.skip(f"{missing}: missing")
