"""A sound bundle, and a copy of it for a test to damage."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from avatar_export.checks.bundle import validate
from tests import bundles


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return bundles.write(tmp_path_factory.mktemp("bundle") / "good")


@pytest.fixture
def bundle(good: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(good, tmp_path / "bundle"))


def found(path: Path) -> list[tuple[str, str, bool]]:
    """(path, message, whether it is a warning) of every problem."""
    return [(p.path, p.message, p.warning) for p in validate(path)]
