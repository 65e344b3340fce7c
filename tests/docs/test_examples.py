"""Every example of the command pages does what it says, as a reader types it; `make test-more` runs them."""

from __future__ import annotations

import re
import shlex
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from tests.avatars import full_avatar
from tests.docs.conftest import ran

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
    for line in lines:
        first, *rest = shlex.split(line.replace("\\\n", " "))
        module = ["-m", PROGRAMS[first]] if first in PROGRAMS else []
        done = ran([sys.executable, *module, *rest], tmp_path)
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"


@pytest.mark.more
def test_made_sections_are_up_to_date() -> None:
    done = ran([sys.executable, "docs/tools/generate.py", "--check"], ROOT)
    assert done.returncode == 0, f"run `python docs/tools/generate.py`:\n{done.stdout}{done.stderr}"


PAGE = ROOT / "docs" / "reference" / "python.md"
README = ROOT / "runtime" / "README.md"
FRAGMENT = re.compile(r"^```python(?: run)?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FRAGMENTS = [fragment for page in (PAGE, README) for fragment in FRAGMENT.findall(page.read_text("utf-8"))]
SHOWN = re.compile(r"^print\(.*\)  # (\([\d, ]+\)), ", re.MULTILINE)  # what a fragment says that it prints


def test_it_imports_public_names_alone() -> None:
    imports = [line for fragment in FRAGMENTS for line in fragment.splitlines() if "import" in line]
    public = re.compile(r"import numpy as np$|from avatar_(runtime|export) import ")
    assert imports and [line for line in imports if not public.match(line)] == []


@pytest.mark.more
@pytest.mark.parametrize("fragment", FRAGMENTS)
def test_fragments_run(fragment: str, tmp_path: Path) -> None:
    demo = tmp_path / "out" / "demo"
    demo.mkdir(parents=True)
    (demo / "avatar").symlink_to(ROOT / "samples" / "trained" / "head_blendshapes")
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    avatar = full_avatar()
    (tmp_path / "head.avatar").write_bytes(pack([avatar, avatar], Fineness()).file)
    command = [sys.executable, "-c", fragment.replace("Player(avatar)", 'Player(avatar, "reference")')]
    done = ran(command, tmp_path)
    assert done.returncode == 0 and done.stdout, done.stderr
    assert all(shown in done.stdout for shown in SHOWN.findall(fragment)), done.stdout


PAGES = sorted((ROOT / "docs" / "researcher").glob("*.md"))
BLOCK = re.compile(r"^```([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SHELL = f'python() {{ {shlex.quote(sys.executable)} "$@"; }}\n'
SHELL += "".join(f'{name}() {{ python -m {module} "$@"; }}\n' for name, module in PROGRAMS.items())


@pytest.mark.more
@pytest.mark.parametrize(
    "page", [p for p in PAGES if "```sh run" in p.read_text()], ids=lambda page: page.stem
)
def test_commands_print_what_the_page_says(page: Path, tmp_path: Path) -> None:
    """A block `sh run` is run by bash; each line of the block `text output` after it is in what it printed."""
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    (tmp_path / "out").mkdir()
    found = BLOCK.findall(page.read_text("utf-8"))
    for (kind, text), (following, output) in zip(found, [*found[1:], ("", "")], strict=True):
        if kind == "sh run":
            done = ran(["bash", "-c", SHELL + text], tmp_path)
            printed = done.stdout + done.stderr
            expected = output.strip().splitlines() if following == "text output" else []
            assert "Traceback" not in printed, printed
            assert not [line for line in expected if line not in printed], f"{text}\n{printed}"
            refused = any(line.startswith("avatar-export: ") for line in expected)
            assert done.returncode == (2 if refused else 0), f"{text}\n{printed}"
