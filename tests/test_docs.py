"""What the documents point at is there, and they name no machine."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = sorted(
    path
    for folder in (".", "schema", "engine_shaders", "samples", "trainer", "tests/data/golden")
    for path in (ROOT / folder).glob("*.md")
)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_lead_somewhere(document: Path) -> None:
    prose = re.sub(r"```.*?```", "", document.read_text("utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", prose):
        if not target.startswith("https://"):
            assert (document.parent / target).exists(), target


def test_commands_of_the_readme_exist() -> None:
    text = (ROOT / "README.md").read_text("utf-8")
    makefile = (ROOT / "Makefile").read_text("utf-8")
    for name in set(re.findall(r"\bmake ([a-z]+)\b", text)):
        assert f"\n{name}:" in makefile, name
    text += (ROOT / "trainer" / "README.md").read_text("utf-8")
    found = set(re.findall(r"^avatar-(export|train) ([a-z_]+)", text, re.MULTILINE))
    assert {program for program, _ in found} == {"export", "train"}
    for program, command in found:
        module = {"export": "avatar_export", "train": "avatar_trainer"}[program]
        subprocess.run([sys.executable, "-m", module, command, "--help"], check=True, capture_output=True)


def test_the_readme_shows_the_reader_that_the_tests_run() -> None:
    reader = (ROOT / "engine_shaders" / "web" / "read_reference.mjs").read_text("utf-8")
    assert f"```js\n{reader.strip()}\n```" in (ROOT / "README.md").read_text("utf-8")
    assert len(reader.splitlines()) <= 20
