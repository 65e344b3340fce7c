"""What the documents point at is there: files, headings, make targets, commands."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = (
    ".",
    "schema",
    "engine_shaders",
    "runtime",
    "samples",
    "samples/data",
    "trainer",
    "tests/data/bundles",
    "tests/data/golden",
    "players",
    "players/unity",
    "players/unity/Documentation~",
    "players/unreal",
    "players/unreal/Docs",
    "players/native/android",
    "players/native/ios",
    ".github",
)
# Paths of the repository in prose: from its root. Words in capitals and stars stand for something else.
SOURCES = "schema|engine_shaders|runtime|exporter|trainer|players|samples|docs|tests"
NAMED = re.compile(rf"`((?:{SOURCES})/[\w./-]+)`")
DOCUMENTS = sorted(
    {*(path for folder in FOLDERS for path in (ROOT / folder).glob("*.md"))} | {*ROOT.glob("docs/**/*.md")}
)
COMMANDS = ROOT / "docs" / "reference" / "commands"


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def prose_of(document: Path) -> str:
    """Text without code."""
    return re.sub(r"^```.*?^```|`[^`\n]+`", "", document.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)


def anchors_of(document: Path) -> set[str]:
    """What forges and the site call the headings."""
    headings = re.findall(r"^#+ (.*)$", document.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_links_lead_somewhere(document: Path) -> None:
    for target, anchor in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", prose_of(document)):
        if re.match(r"[a-z]+:", target):
            assert target.startswith("https://"), target
            continue
        path = document.parent / target if target else document
        assert path.exists(), target
        assert path.resolve().is_relative_to(ROOT), target
        assert not anchor or anchor in anchors_of(path), f"{target}#{anchor}"


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_paths_that_documents_name_exist(document: Path) -> None:
    named = [name for name in NAMED.findall(document.read_text("utf-8")) if not re.search(r"[A-Z]{4,}", name)]
    assert not [name for name in named if not (ROOT / name).exists()]


def test_make_targets_that_documents_name_exist() -> None:
    makefile = (ROOT / "Makefile").read_text("utf-8")
    named = {
        name
        for document in DOCUMENTS
        for name in re.findall(r"(?:^|`)make ([a-z-]+)", document.read_text("utf-8"), re.M)
    }
    assert {"demo", "test", "docs", "bench"} <= named
    assert not [name for name in named if f"\n{name}:" not in makefile]


def test_commands_that_documents_name_exist() -> None:
    """By the pages made of the commands' help; test_made holds those against the commands."""
    known = {page.relative_to(COMMANDS).with_suffix("").as_posix() for page in COMMANDS.glob("*/*.md")}
    known |= {name.rpartition("_")[0] for name in known if name.startswith("avatar-train/asm")}
    found = {
        f"avatar-{program}/{command}"
        for document in DOCUMENTS
        for block in re.findall(r"^```sh\n(.*?)^```", document.read_text("utf-8"), re.M | re.S)
        for program, command in re.findall(r"^avatar-(export|train) ([a-z_]+)", block, re.M)
    }
    assert len(found) > 12
    assert not found - known
