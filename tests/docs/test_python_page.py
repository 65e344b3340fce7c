"""The Python that the reference page and the runtime's README show runs, by public names alone."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from tests.avatars import full_avatar

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "python.md"
README = ROOT / "runtime" / "README.md"
FRAGMENT = re.compile(r"^```python(?: run)?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FRAGMENTS = [fragment for page in (PAGE, README) for fragment in FRAGMENT.findall(page.read_text("utf-8"))]
SHOWN = re.compile(r"^print\(.*\)  # (\([\d, ]+\)), ", re.MULTILINE)  # what a fragment says that it prints


def test_it_imports_public_names_alone() -> None:
    imports = [line for fragment in FRAGMENTS for line in fragment.splitlines() if "import" in line]
    assert imports
    assert all(
        re.match(r"import numpy as np$|from avatar_(runtime|export) import ", line) for line in imports
    ), imports


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
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0 and done.stdout, done.stderr
    assert all(shown in done.stdout for shown in SHOWN.findall(fragment)), done.stdout
