"""`make size` counts what git tracks; what is made and stays in git is named with its reason."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from tools.size import Tracked, table, tracked

from tests.session.needed import need

ROOT = Path(__file__).parents[2]
REASONS = ROOT / "docs" / "decisions" / "made_files.md"
SAYS_SO = re.compile(r"do not edit", re.IGNORECASE)  # how made files begin
HEAD = 400  # bytes


def git(*command: str) -> str:
    done = subprocess.run(["git", *command], cwd=ROOT, capture_output=True, text=True, check=False)
    need({"a checkout of git": done.returncode == 0})
    return done.stdout


def marked() -> set[str]:
    """Patterns that .gitattributes calls made."""
    return set(re.findall(r"^(\S+) linguist-generated$", (ROOT / ".gitattributes").read_text("utf-8"), re.M))


def test_what_is_made_is_named_with_its_reason() -> None:
    rows = re.findall(r"^\| (`.*?) \| (.+?) \| (.+?) \|$", REASONS.read_text("utf-8"), re.M)
    named = [path for paths, _, _ in rows for path in re.findall(r"`([^`]+)`", paths)]
    assert sorted(named) == sorted(marked()), (
        "docs/decisions/made_files.md and .gitattributes name the same paths"
    )
    for pattern in named:
        assert git("ls-files", f":(glob){pattern}"), f"{pattern}: no such file is in git"


def test_what_says_that_it_is_made_is_marked() -> None:
    made = {path for pattern in marked() for path in git("ls-files", f":(glob){pattern}").splitlines()}
    for path in git("ls-files", "players", "engine_shaders", "exporter").splitlines():
        head = (ROOT / path).read_bytes()[:HEAD].decode("utf-8", "replace") if (ROOT / path).is_file() else ""
        assert path in made or path.endswith(".py") or not SAYS_SO.search(head), (
            f"{path} is made, but not marked"
        )


def test_files_are_counted_once_and_by_kind() -> None:
    files = [
        Tracked("a.py", b"one\ntwo", False, False),
        Tracked("players/unity/Tests/A.cs", b"one\n", False, False),
        Tracked("tests/made.ts", b"one\n", True, False),
        Tracked(
            "b.md", b"Two words.\n\n```sh\nno word\n```\n<!-- nor here -->\n[a link](x/y.md)\n", False, False
        ),
        Tracked("tests/data/a.csv", b"1\n", False, True),
        Tracked("a.png", b"\0\n\n", False, False),
    ]
    assert [file.kind for file in files] == ["source", "tests", "made", "Markdown", "data", "data"]
    assert [file.lines for file in files] == [2, 1, 1, 7, 1, 0]
    lines = [line.split() for line in table(files).splitlines()]
    assert lines[1:6] == [
        ["source", "1", "2"], ["tests", "1", "1"], ["made", "1", "1"], ["Markdown", "1", "7"], ["data", "2", "1"],
    ]  # fmt: skip
    assert lines[6:] == [["without", "data", "4", "11"], ["all", "6", "12"], ["1", "pages,", "4", "words"]]


def test_attributes_and_contents_are_those_of_the_revision() -> None:
    git("rev-parse", "HEAD")
    files = {file.path: file for file in tracked("HEAD")}
    assert len(files) == len(git("ls-tree", "-r", "--name-only", "HEAD").splitlines())
    assert files["tests/interop/package-lock.json"].kind == "made"
    assert files["tests/data/bundles/README.md"].kind == "data" and files["README.md"].kind == "Markdown"
    assert files["LICENSE"].content.decode() == git("show", "HEAD:LICENSE")
