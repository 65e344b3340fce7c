"""The lists of derived files in the documents are those of the table of writers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from avatar_export.writers.table import WRITERS

ROOT = Path(__file__).parents[2]
NAME = re.compile(r"`([\w./]+)`")


def top(path: str) -> str:
    """The file, or the folder that holds it."""
    folder, slash, _ = path.partition("/")
    return f"{folder}/" if slash else path


DERIVED = {top(writer.path) for writer in WRITERS if writer.derived} | {"reference/"}
NORMATIVE = {top(writer.path) for writer in WRITERS if not writer.derived}


@pytest.mark.parametrize("page", ["schema/BUNDLE.md", "schema/SPEC.md"])
def test_tables_of_the_bundle(page: str) -> None:
    listed: dict[str, bool] = {}
    for line in (ROOT / page).read_text("utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("| `") and len(cells) > 2 and re.match(r"(yes|no)\b", cells[-1]):
            for name in NAME.findall(cells[0]):
                listed.setdefault(top(name), cells[-1].startswith("yes"))
    assert {name for name, derived in listed.items() if derived} >= DERIVED
    assert not {name for name, derived in listed.items() if derived} & NORMATIVE
    assert listed["enhancer.onnx"] is False
