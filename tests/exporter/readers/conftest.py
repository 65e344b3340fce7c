"""Fixtures of more than one reader's tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.exporter.readers import splatting_files


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A sound SplattingAvatar run; of the command of this name no reader's test has need."""
    splatting_files.write_splatting_run(tmp_path / "subject", splatting_files.arrays())
    return tmp_path / "subject"
