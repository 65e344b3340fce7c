"""The pages on engines: every claim is marked, what they call tested has a test, and every page is whole."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
DOCS = TESTS.parent / "docs" / "engines"
ENGINES = ("unity", "unreal", "godot", "blender", "three", "babylon", "usd")
OTHERS = ("README", "engine_pose")
SECTIONS = (
    "1. What to import",
    "2. What the importer does",
    "3. Settings",
    "4. Vertex map",
    "5. Play a pose",
    "6. Splats",
    "7. Limits",
)
TOPICS = (  # of section 2, in this order
    "axes and units",
    "triangle order",
    "corner order",
    "vertex order",
    "splits and welds",
    "unused vertices",
    "`_VERTEX_ID`",
    "TEXCOORD_0",
    "morph targets",
    "weight of 1",
    "influences",
    "joints and root",
    "animations",
)
TESTED = re.compile(r"\*\*\[tested here\]\*\*<!-- ([\w, ]+) -->")  # readers see no name of a test
MARK = re.compile(TESTED.pattern + r"|\*\*\[(source:\s*[^\]]+|unchecked)\]\*\*")


def text_of(page: str) -> str:
    return (DOCS / f"{page}.md").read_text("utf-8")


def section(page: str, number: int) -> str:
    """Text of a numbered section, without fragments."""
    plain = re.sub(r"^```.*?^```$", "", text_of(page), flags=re.MULTILINE | re.DOTALL)
    return re.split(r"^## .*$", plain, flags=re.MULTILINE)[number]


def items(text: str) -> list[str]:
    """The bullets of a text with the lines that belong to them."""
    return [item for item in re.split(r"^- ", text, flags=re.MULTILINE)[1:] if item.strip()]


def existing_tests() -> set[str]:
    """Names of all test functions below tests/."""
    return {
        node.name
        for path in TESTS.rglob("test_*.py")
        if "node_modules" not in path.parts
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
    }


def test_what_is_called_tested_has_a_test() -> None:
    named = {
        (page, name)
        for page in (*ENGINES, *OTHERS)
        for names in TESTED.findall(text_of(page))
        for name in re.split(r",\s*", names.strip())
    }
    known = existing_tests()
    assert len(named) > 50
    assert not sorted((page, name) for page, name in named if name not in known)


def test_every_page_is_in_the_index_and_the_other_way_round() -> None:
    linked = set(re.findall(r"\]\(([a-z_-]+)\.md[#)]", text_of("README")))
    assert linked == {path.stem for path in DOCS.glob("*.md")} - {"README"} == {*ENGINES, "engine_pose"}


@pytest.mark.parametrize("page", ENGINES)
def test_a_page_has_the_sections_and_topics(page: str) -> None:
    headings = tuple(re.findall(r"^## (.*)$", text_of(page), re.MULTILINE))
    assert headings == SECTIONS
    rows = re.findall(r"^\| (.*?) \|", section(page, 2), re.MULTILINE)
    assert tuple(rows[1:]) == TOPICS
    assert 60 <= len(text_of(page).splitlines()) <= 140


@pytest.mark.parametrize("page", ENGINES)
def test_every_claim_is_marked(page: str) -> None:
    rows = [row for row in re.findall(r"^\|.*\|$", section(page, 2), re.MULTILINE)[2:]]
    claims = rows + [item for number in (1, 2, 3, 5, 6, 7) for item in items(section(page, number))]
    assert len(claims) >= len(TOPICS) + 8
    assert not [claim for claim in claims if not MARK.search(claim)]
