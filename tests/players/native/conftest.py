"""A test that takes `machine` runs on every machine that can be had here."""

from __future__ import annotations

import pytest

from tests.players.native.machines import ELSEWHERE, HERE, Machine, parameters


@pytest.fixture(params=parameters(HERE, *ELSEWHERE))
def machine(request: pytest.FixtureRequest) -> Machine:
    """One of them."""
    found: Machine = request.param
    found.need()
    return found
