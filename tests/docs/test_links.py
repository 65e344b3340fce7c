"""What the documents point at is there: files, headings, make targets, commands."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.docs.conftest import SITE

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


def name_of(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def prose_of(document: Path) -> str:
    """Text without code."""
    return re.sub(r"^```.*?^```|`[^`\n]+`", "", document.read_text("utf-8"), flags=re.DOTALL | re.MULTILINE)


def anchors_of(document: Path) -> set[str]:
    """What forges and the site call the headings."""
    headings = re.findall(r"^#+ (.*)$", document.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}


def wrong_links(document: Path, place: Path, made: Callable[[], Path]) -> list[str]:
    """Links of a document that lead nowhere, if it stands at `place`. `made` has the pages that stand in SITE."""
    wrong = []
    for target, anchor in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", prose_of(document)):
        if re.match(r"[a-z]+:", target):
            wrong += [] if target.startswith("https://") else [target]
            continue
        path = Path(os.path.normpath(place.parent / target)) if target else place
        if path.is_relative_to(SITE):
            path = made() / path.relative_to(SITE)
        elif not path.is_relative_to(ROOT):
            wrong.append(target)
        if not path.exists() or (anchor and anchor not in anchors_of(path)):
            wrong.append(f"{target}#{anchor}")
    return wrong


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_links_lead_somewhere(document: Path, request: pytest.FixtureRequest) -> None:
    assert not wrong_links(document, document, lambda: request.getfixturevalue("command_pages"))


def test_links_of_the_pages_of_commands_lead_somewhere(command_pages: Path) -> None:
    pages = sorted(command_pages.rglob("*.md"))
    assert len(pages) > 25
    wrong = [
        wrong_links(page, SITE / page.relative_to(command_pages), lambda: command_pages) for page in pages
    ]
    assert not [targets for targets in wrong if targets]


def test_a_link_to_a_page_of_a_command_that_is_not_made_is_found(command_pages: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text(
        "[a](commands/avatar-export/pack.md#options) [b](commands/avatar-export/gone.md)", "utf-8"
    )
    wrong = wrong_links(page, SITE.parent / "index.md", lambda: command_pages)
    assert wrong == ["commands/avatar-export/gone.md#"]


def test_documents_beside_the_site_link_to_no_page_that_a_forge_lacks() -> None:
    """The overview of the reference alone does: it says where these pages are."""
    linking = [name_of(page) for page in DOCUMENTS if "reference/commands" in page.read_text("utf-8")]
    assert not linking


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


def test_commands_that_documents_name_exist(command_pages: Path) -> None:
    """By the pages made of the commands' help."""
    known = {
        page.relative_to(command_pages).with_suffix("").as_posix() for page in command_pages.glob("*/*.md")
    }
    known |= {name.rpartition("_")[0] for name in known if name.startswith("avatar-train/asm")}
    found = {
        f"avatar-{program}/{command}"
        for document in DOCUMENTS
        for block in re.findall(r"^```sh\n(.*?)^```", document.read_text("utf-8"), re.M | re.S)
        for program, command in re.findall(r"^avatar-(export|train) ([a-z_]+)", block, re.M)
    }
    assert len(found) > 12
    assert not found - known
