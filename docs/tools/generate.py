"""Makes what the documents do not say by hand: `python docs/tools/generate.py` writes, `--check` names what differs.

Made sections stand between `<!-- made: NAME -->` and `<!-- end -->`. The pages of commands are made with the site.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

import engine_tables
import figures
import vocabulary
import worked_numbers

ROOT = Path(__file__).resolve().parents[2]
SECTION = re.compile(r"(<!-- made: ([a-z_-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if anything differs")
    check = parser.parse_args().check
    differing = {path: text for path, text in made().items() if path.read_text("utf-8") != text}
    for path, text in differing.items():
        print(f"{'differs' if check else 'made'}: {path.relative_to(ROOT)}")
        if not check:
            path.write_text(text, "utf-8")
    sys.exit(1 if check and differing else 0)


PORTER = {
    "first_stage": lambda page: fenced("c", page.with_suffix(".c")),
    "reader": lambda _: fenced("js", ROOT / "engine_shaders" / "web" / "read_reference.mjs"),
    "skin_numbers": lambda _: worked_numbers.skin_numbers(),
    "surface_numbers": lambda _: worked_numbers.surface_numbers(),
    "vocabulary": vocabulary.vocabulary,
}


def fenced(language: str, file: Path) -> str:
    """A file of the repository as code on a page."""
    return f"```{language}\n{file.read_text('utf-8').strip()}\n```"


def made() -> dict[Path, str]:
    """Every page with a made section, as it should be."""
    texts = {
        page: page.read_text("utf-8") for page in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
    }
    return {
        page: SECTION.sub(lambda match, page=page: filled(match, page), text)
        for page, text in texts.items()
        if SECTION.search(text)
    }


def filled(match: re.Match[str], page: Path) -> str:
    """A section with its contents."""
    contents = {**engine_tables.SECTIONS, **figures.SECTIONS, **PORTER}
    if match[2] not in contents:
        sys.exit(f"{page.relative_to(ROOT)}: nothing makes section {match[2]}")
    return f"{match[1]}\n{contents[match[2]](page).strip()}\n\n{match[3]}"


if __name__ == "__main__":
    main()
