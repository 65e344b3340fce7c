"""Both distributions as `make dist` makes them, built once."""

from __future__ import annotations

from pathlib import Path

import pytest

from tools import dist


@pytest.fixture(scope="session")
def built(
    built_godot: None, built_web: None, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, list[Path]]:
    """[sdist, wheel] of each distribution, by its name; what `dist.check` demands holds."""
    out = tmp_path_factory.mktemp("dist")
    return {name: dist.make(given, out) for name, given in dist.distributions().items()}


@pytest.fixture(scope="session")
def wheels(built: dict[str, list[Path]]) -> dict[str, Path]:
    """The wheel of each distribution, by its name."""
    return {name: wheel for name, (_, wheel) in built.items()}
