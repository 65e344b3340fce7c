"""The table of public names in every language, from vocabulary.csv."""

from __future__ import annotations

import csv
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
    """The rows of vocabulary.csv: OWNER.MEMBER, functions, types; nothing where a language has no name of its own."""
    with Path(__file__).with_suffix(".csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def names(row: dict[str, str], language: str) -> list[str]:
    """The public names of a concept in a language."""
    return [name for name in row[language].split(", ") if name]


def vocabulary(_: Path) -> str:
    """A row for each concept, a column for each language."""
    rows = [
        [row["concept"], *(", ".join(f"`{name}`" for name in names(row, language)) for language in LANGUAGES)]
        for row in concepts()
    ]
    return table(["what", *LANGUAGES.values()], rows)
