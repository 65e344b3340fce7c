"""Pages and tables that a script makes are as it makes them; `make test-more` runs this."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.more
def test_made_pages_are_up_to_date() -> None:
    """In an odd terminal, for neither its width nor its colours may matter."""
    environment = {**os.environ, "COLUMNS": "47", "FORCE_COLOR": "1", "TERM": "xterm-256color"}
    command = [sys.executable, "docs/tools/generate.py", "--check"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, f"run `python docs/tools/generate.py`:\n{done.stdout}{done.stderr}"
