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


def write_command_pages(folder: Path, **environment: str) -> Path:
    """Writes them into a folder."""
    command = [sys.executable, "docs/tools/command_pages.py", str(folder)]
    subprocess.run(command, cwd=ROOT, env={**os.environ, **environment}, check=True)
    return folder


@pytest.fixture(scope="session")
def command_pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the pages, made once for all workers."""
    return made_once(tmp_path_factory, "command_pages", write_command_pages)
