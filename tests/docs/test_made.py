"""Tables that a script makes are as it makes them, and pages of commands are whole; `make test-more` runs this."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.docs.conftest import write_command_pages

ROOT = Path(__file__).parents[2]


@pytest.mark.more
def test_made_sections_are_up_to_date() -> None:
    command = [sys.executable, "docs/tools/generate.py", "--check"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"run `python docs/tools/generate.py`:\n{done.stdout}{done.stderr}"


@pytest.mark.more
def test_pages_of_commands_are_the_same_in_an_odd_terminal(command_pages: Path, tmp_path: Path) -> None:
    """Neither its width nor its colours matter."""
    odd = write_command_pages(tmp_path, COLUMNS="47", FORCE_COLOR="1", TERM="xterm-256color")
    pages = {page.relative_to(odd): page.read_text("utf-8") for page in odd.rglob("*.md")}
    assert pages == {
        page.relative_to(command_pages): page.read_text("utf-8") for page in command_pages.rglob("*.md")
    }
    page = pages[Path("avatar-export/convert.md")]
    assert page.startswith("# avatar-export convert\n") and "\n## Examples\n" in page
    assert "| `--handedness` |" in page and "\x1b" not in page
