"""The README stays a front door: words, code and figures are counted, what matters stands near the top."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
MOST_WORDS = 900
MOST_CODE_LINES = 8
FIRST_SCREEN = 40  # lines of Markdown
CODE = re.compile(r"^```.*?\n(.*?)^```$", re.MULTILINE | re.DOTALL)


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


def test_code_is_short() -> None:
    blocks = [len(block.splitlines()) for block in CODE.findall(README)]
    print(f"README.md: code blocks of {blocks} lines")
    assert blocks and max(blocks) <= MOST_CODE_LINES


def test_at_most_one_line_has_measured_figures() -> None:
    """A figure with a unit of measurement: metres, degrees, milliseconds, decibels."""
    measured = [
        line
        for line in README.splitlines()
        if re.search(r"\d(e-\d+)? ?(m|mm|ms|s|dB|degrees|MB|fps)\b", line)
    ]
    assert len(measured) <= 1, measured


def test_the_first_screen_says_what_moves_and_shows_something_moving() -> None:
    top = "\n".join(README.splitlines()[:FIRST_SCREEN])
    assert "Gaussians move in browsers, in Python and in C++" in top and "Gaussians stand still" in top
    assert re.search(r"!\[.*?\]\(samples/\w+\.webp\)", top)
    for engine in ("Blender", "Unity", "Unreal", "Godot", "three.js", "Babylon.js"):
        assert f"| [{engine}" in top, engine
    assert top.count("never") >= 4


def test_every_reader_has_a_way_on() -> None:
    for page in (
        "start",
        "convert",
        "artist/index",
        "researcher/index",
        "porter/index",
        "accuracy",
        "performance",
    ):
        assert f"](docs/{page}.md)" in README, page
