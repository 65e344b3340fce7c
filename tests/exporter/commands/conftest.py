"""A bundle with a reference, and a copy of it for a test to damage."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from avatar_export.writers.bundle import write_bundle
from tests.avatars import full_avatar


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("conform") / "good"
    write_bundle(full_avatar(), out, preview=False, engine_files=False)
    return out


@pytest.fixture
def bundle(good: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(good, tmp_path / "bundle"))
