"""The pages of commands, which the site makes and no checkout holds."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.session.shared_folder import made_once

ROOT = Path(__file__).parents[2]
SITE = ROOT / "docs" / "reference" / "commands"  # where links find them


def ran(command: list[str], folder: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """A program that ran in a folder and sees the checkout, as wide as a line may be; half an hour at most."""
    paths = os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])
    around = {**os.environ, "PYTHONPATH": paths, "COLUMNS": "1000", **environment}
    return subprocess.run(
        command, cwd=folder, env=around, capture_output=True, text=True, check=False, timeout=1800
    )


def write_command_pages(folder: Path, **environment: str) -> Path:
    done = ran([sys.executable, "docs/tools/command_pages.py", str(folder)], ROOT, **environment)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture(scope="session")
def command_pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the pages, made once for all workers."""
    return made_once(tmp_path_factory, "command_pages", write_command_pages)
