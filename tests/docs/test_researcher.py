"""The researcher's pages: their commands run as a reader types them, and print the messages that stand below them.

A block `sh run` is run by bash in an empty folder beside `samples`; each line of the block `text output` after it must
be in what it printed. `make test-more` runs them, one test for each page: each page makes its own inputs.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs" / "researcher").glob("*.md"))
BLOCK = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PLACEHOLDERS = ("CHECKPOINT", "RUN", "BUNDLE", "capture")  # what a block that is not run must name
SECONDS = 1800.0  # of one block, on a busy machine
PROGRAMS = {"python": "", "avatar-export": "-m avatar_export", "avatar-train": "-m avatar_trainer"}
FUNCTIONS = "\n".join(
    f'{name}() {{ {shlex.quote(sys.executable)} {module} "$@"; }}' for name, module in PROGRAMS.items()
)


def blocks(page: Path) -> list[tuple[str, str]]:
    """(kind, text) of each fenced block."""
    return BLOCK.findall(page.read_text("utf-8"))


def said(script: str, folder: Path) -> str:
    """What bash prints, with whole lines whatever the width of a terminal."""
    environment = {
        **os.environ,
        "COLUMNS": "1000",
        "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
    }
    done = subprocess.run(
        ["bash", "-c", f"{FUNCTIONS}\n{script}"],
        cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=SECONDS,
    )  # fmt: skip
    assert "Traceback" not in done.stderr, done.stderr
    return done.stdout + done.stderr + f"exit code {done.returncode}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_blocks_are_run_or_name_a_placeholder(page: Path) -> None:
    found = blocks(page)
    for (before, _), (kind, _) in zip([("", ""), *found], found, strict=False):
        assert kind != "text output" or before == "sh run", f"{page.name}: an output without its command"
    idle = [text for kind, text in found if kind == "sh"]
    assert all(any(word in text for word in PLACEHOLDERS) or "pip install" in text for text in idle)


@pytest.mark.more
@pytest.mark.parametrize(
    "page", [p for p in PAGES if "sh run" in dict(blocks(p))], ids=lambda page: page.stem
)
def test_commands_print_what_the_page_says(page: Path, tmp_path: Path) -> None:
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    (tmp_path / "out").mkdir()
    found = blocks(page)
    for at, (kind, text) in enumerate(found):
        if kind != "sh run":
            continue
        printed = said(text, tmp_path)
        following = found[at + 1] if at + 1 < len(found) else ("", "")
        expected = following[1].strip().splitlines() if following[0] == "text output" else []
        missing = [line for line in expected if line not in printed]
        assert not missing, f"{page.name}: {text}\ndoes not print {missing}\nbut {printed}"
        refused = any(line.startswith("avatar-export: ") for line in expected)
        assert printed.endswith("exit code 2" if refused else "exit code 0"), (
            f"{page.name}: {text}\n{printed}"
        )
