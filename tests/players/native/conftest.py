"""A test that takes `machine` runs on every machine that can be had here."""

from __future__ import annotations

import pytest

from tests.players.native.machines import MACHINES, Machine, parameters


@pytest.fixture(params=parameters(list(MACHINES)))
def machine(request: pytest.FixtureRequest) -> Machine:
    """One of MACHINES."""
    found = MACHINES[request.param]
    found.need()
    return found
