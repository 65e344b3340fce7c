"""Every example of the command pages does what it says, as a reader types it; `make test-more` runs them."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import time
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "docs" / "tools" / "examples.toml"
PROGRAMS = {"avatar-export": "avatar_export", "avatar-train": "avatar_trainer"}
FEWEST = 2  # examples a command
REASON = 10  # letters of a reason at least


def document() -> dict[str, Any]:
    return tomllib.loads(EXAMPLES.read_text("utf-8"))


def test_every_command_has_examples_that_run_or_say_why_not(command_pages: Path) -> None:
    commands = [example["command"] for example in document()["example"]]
    pages = {
        page.relative_to(command_pages).with_suffix("").as_posix() for page in command_pages.glob("*/*.md")
    }
    assert {command.replace(" ", "/", 1).replace(" ", "_") for command in commands} == pages
    assert not [command for command in set(commands) if commands.count(command) < FEWEST]
    for example in document()["example"]:
        assert example["run"].strip().startswith(example["command"])
        assert len(example.get("not_run", "x" * REASON)) >= REASON
    run = {example["command"] for example in document()["example"] if "not_run" not in example}
    assert run == set(commands), "a command none of whose examples is run"


@pytest.mark.more
@pytest.mark.parametrize("program", PROGRAMS)
def test_examples_run(program: str, tmp_path: Path) -> None:
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    found = document()
    lines = found["setup"][program]
    lines += [e["run"] for e in found["example"] if e["command"].split()[0] == program and "not_run" not in e]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")])}
    for line in lines:
        first, *rest = shlex.split(line.replace("\\\n", " "))
        command = (
            [sys.executable, "-m", PROGRAMS[first], *rest] if first in PROGRAMS else [sys.executable, *rest]
        )
        start = time.perf_counter()
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        print(f"{time.perf_counter() - start:6.1f} s  {' '.join(line.split())}")
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
