"""The command line where Numba is not installed: everything works, and one line says what is slow."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

BUNDLE = Path(__file__).parents[2] / "data" / "bundles" / "0.1.0" / "every_field.avatar.zip"
SLOW = (
    "avatar-export: without Numba drawing takes some 40 times as long, and so does `pack --levels`: "
    'pip install -e ".[fast]"\n'
)
PROGRAM = """
import importlib.util, sys
find = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "numba" else find(name, *rest)
class Hidden:
    def find_spec(self, name, *rest):
        if name.partition(".")[0] in ("numba", "llvmlite"):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Hidden())
from avatar_export.__main__ import main
main()
"""


def run(*words: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", PROGRAM, *words], capture_output=True, text=True)


@pytest.mark.parametrize(
    "words",
    [
        ("render", BUNDLE, "--size", "32", "-o", "drawn.png"),
        pytest.param(("pack", BUNDLE, "--levels", "1,0.5", "-o", "small.avatar"), marks=pytest.mark.more),
    ],
)
def test_it_works_and_says_once_what_is_slow(words: tuple[str | Path, ...], tmp_path: Path) -> None:
    done = run(*words[:-1], tmp_path / words[-1])
    assert done.returncode in (0, 1), done.stderr
    assert done.stderr.startswith(SLOW) and done.stderr.count("Numba") == 1
    assert (tmp_path / words[-1]).stat().st_size


@pytest.mark.parametrize("words", [("inspect", BUNDLE), ("render", "--backend=reference", "--help")])
def test_it_says_nothing_where_nothing_is_slow(words: tuple[str | Path, ...]) -> None:
    assert "Numba" not in run(*words).stderr
