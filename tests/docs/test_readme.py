"""The README stays a door: it is short."""

from __future__ import annotations

import re
from pathlib import Path

README = (Path(__file__).parents[2] / "README.md").read_text("utf-8")
MOST_WORDS = 500


def words(text: str) -> list[str]:
    """The words of prose, tables and code: runs with a letter or digit, without targets of links, comments and tags."""
    plain = re.sub(r"<!--.*?-->", " ", text, flags=re.DOTALL)
    plain = re.sub(r"\]\([^)]*\)", "] ", plain)  # targets of links and images; their text counts
    plain = re.sub(r"<[a-zA-Z/][^>]*>|https?://\S+", " ", plain)
    return [word for word in re.split(r"[\s|]+", plain) if re.search(r"\w", word)]


def test_words_are_counted_as_a_reader_would() -> None:
    sample = "# Two words\n\n[a link](docs/x.md#y) `--flag` <br/>\n|---|---|\n| one | 2 |\n"
    sample += "<!-- no --> https://x.y ![alt](z.webp)"
    assert len(words(sample)) == 8, words(sample)  # Two words a link --flag one 2 alt


def test_the_readme_is_short() -> None:
    count = len(words(README))
    print(f"README.md: {count} words")
    assert count <= MOST_WORDS
