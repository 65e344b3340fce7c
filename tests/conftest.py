"""Fixtures that more than one folder of tests uses."""

from __future__ import annotations

import os

import pytest
from hypothesis import settings

from tests.golden import ON, UNPACK, BlendshapesGolden

# As avatar-train sets it: torch's and Numba's threads take the cores from each other while they wait.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

# The same examples on every run, and no failure because the machine was busy.
settings.register_profile("steady", derandomize=True, deadline=None)
settings.load_profile("steady")


@pytest.fixture(scope="session", params=list(UNPACK))
def blendshapes_golden(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> BlendshapesGolden:
    """The Gaussian Blendshapes vectors: as committed, and in full where the optional data is present."""
    return UNPACK[request.param](tmp_path_factory.mktemp(f"gaussian_blendshapes_{request.param}"))


@pytest.fixture(params=list(ON))
def backend(request: pytest.FixtureRequest) -> str:
    """Each backend that draws both profiles: the released codes' numbers judge them all."""
    name: str = request.param
    return name


pytest_plugins = ["tests.commands", "tests.measured", "tests.samples_made"]
