"""The table of public names in every language, from vocabulary.toml."""

from __future__ import annotations

import tomllib
from pathlib import Path

from engine_tables import table

LANGUAGES = {
    "python": "Python",
    "typescript": "TypeScript",
    "c": "C",
    "csharp": "C#, Unity",
    "unreal": "Unreal",
}


def concepts() -> list[dict[str, str]]:
    """The rows of vocabulary.toml."""
    rows: list[dict[str, str]] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))[
        "concept"
    ]
    return rows


def names(row: dict[str, str], language: str) -> list[str]:
    """The public names of a concept in a language."""
    return [name for name in row.get(language, "").split(", ") if name]


def vocabulary(_: Path) -> str:
    """A row for each concept, a column for each language."""
    rows = [
        [row["concept"], *(", ".join(f"`{name}`" for name in names(row, language)) for language in LANGUAGES)]
        for row in concepts()
    ]
    return table(["what", *LANGUAGES.values()], rows)
