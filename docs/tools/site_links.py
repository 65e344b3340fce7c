"""MkDocs hook: files outside docs/ that a page links to join the site under repository/, at their own path.

So a link such as `../schema/SPEC.md` works on a forge, in an editor and in the site, and is written once. Markdown
files become pages, whose own links are followed too; a link to a folder means its README.md. Other files are copied.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
OUTSIDE = "repository/"

# Targets of links and images; code is masked before.
LINK = re.compile(r"(\]\(\s*|<(?:img|a|source)[^>]*?(?:src|href)=\")([^)\s\"]+)")
# "```python run" tells the tests to run a fragment; the site's highlighter wants the language alone.
FENCE = re.compile(r"^(```\w+) [\w ]+$", re.MULTILINE)
CODE = re.compile(r"^(```|~~~).*?^\1|`[^`\n]+`", re.MULTILINE | re.DOTALL)


def on_files(files: Files, config: Any) -> Files:
    """Add what the pages link to outside docs/, and what those files link to."""
    pages = [Path(file.abs_src_path) for file in files.documentation_pages() if file.abs_src_path]
    pages += [ROOT / path for path in nav_paths(config["nav"])]
    known: set[Path] = set()
    while pages:
        page = pages.pop()
        found = {page} if not page.is_relative_to(DOCS) else set()
        if page.suffix == ".md":
            found |= set(outside_targets(page))
        for path in found - known:
            known.add(path)
            files.append(File.generated(config, site_path(path), abs_src_path=str(path)))
            pages.append(path)
    return files


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Point links at where the site has their targets."""
    source = Path(page.file.abs_src_path)

    def moved(match: re.Match[str]) -> str:
        target, _, anchor = match[2].partition("#")
        path = target_of(source, target)
        if path is None or (path.is_relative_to(DOCS) and source.is_relative_to(DOCS)):
            return match[0]
        place = site_path(path) if not path.is_relative_to(DOCS) else path.relative_to(DOCS).as_posix()
        relative = os.path.relpath(place, Path(page.file.src_uri).parent).replace(os.sep, "/")
        return f"{match[1]}{relative}{'#' + anchor if anchor else ''}"

    markdown = FENCE.sub(r"\1", markdown)
    # No page here has links by reference, so `[rows][columns]` is text.
    return outside_code(markdown, lambda text: LINK.sub(moved, text).replace("][", "]\\["))


def outside_code(markdown: str, change: Any) -> str:
    """`change` applied to all text that is not code."""
    result, end = [], 0
    for code in CODE.finditer(markdown):
        result += [change(markdown[end : code.start()]), code[0]]
        end = code.end()
    return "".join([*result, change(markdown[end:])])


def outside_targets(page: Path) -> list[Path]:
    """Existing files outside docs/ that a page links to."""
    found: list[Path] = []

    def note(text: str) -> str:
        paths = (target_of(page, match[2].partition("#")[0]) for match in LINK.finditer(text))
        found.extend(path for path in paths if path and not path.is_relative_to(DOCS))
        return text

    outside_code(page.read_text("utf-8"), note)
    return found


def target_of(page: Path, target: str) -> Path | None:
    """The file of the repository that a link on `page` means; None where it is no such file."""
    if not target or re.match(r"[a-z]+:", target):
        return None
    path = Path(os.path.normpath(page.parent / unquote(target)))
    if path.is_dir() and (path / "README.md").exists():
        path /= "README.md"
    return path if path.is_file() and path.is_relative_to(ROOT) else None


def site_path(path: Path) -> str:
    """Where the site has a file of the repository that is not in docs/."""
    return OUTSIDE + path.relative_to(ROOT).as_posix()


def nav_paths(nav: Any) -> list[str]:
    """Paths below repository/ that the navigation names."""
    if isinstance(nav, str):
        return [nav.removeprefix(OUTSIDE)] if nav.startswith(OUTSIDE) else []
    items = nav.values() if isinstance(nav, dict) else nav
    return [path for item in items for path in nav_paths(item)]
