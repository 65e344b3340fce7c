"""MkDocs hook: pages of commands, and files outside docs/, join the site.

The page of each command is made here (command_pages.py), and the navigation lists it. A file outside docs/ that a page
links to joins under repository/, at its own path. So a link such as `../schema/SPEC.md` works on a forge, in an editor
and in the site, and is written once. Markdown files become pages, whose own links are followed too; a link to a folder
means its README.md. Other files are copied. The web player's plain page gets the built package beside it, so it runs.
"""

from __future__ import annotations

import os
import re
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import command_pages
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
OUTSIDE = "repository/"
WEB = ROOT / "players" / "web"
EXAMPLE = WEB / "examples" / "plain"  # a page with an avatar
COMMANDS = "Commands"  # the entry of the navigation that gets the pages of commands

# Targets of links and images; code is masked before.
LINK = re.compile(r"(\]\(\s*|<(?:img|a|source)[^>]*?(?:src|href)=\")([^)\s\"]+)")
# "```python run" tells the tests to run a fragment; the site's highlighter wants the language alone.
FENCE = re.compile(r"^(```\w+) [\w ]+$", re.MULTILINE)
CODE = re.compile(r"^(```|~~~).*?^\1|`[^`\n]+`", re.MULTILINE | re.DOTALL)


def on_config(config: Any) -> Any:
    """List the pages of commands in the navigation."""
    config["nav"] = filled(config["nav"])
    return config


def filled(nav: Any) -> Any:
    """The navigation with the pages of commands below the entry COMMANDS."""
    if isinstance(nav, list):
        return [filled(item) for item in nav]
    if isinstance(nav, dict):
        return {
            title: list(made_pages()) if title == COMMANDS else filled(below) for title, below in nav.items()
        }
    return nav


@cache
def made_pages() -> dict[str, str]:
    """{path in the site: text} of the pages of commands; `mkdocs serve` makes them once."""
    return {f"{command_pages.FOLDER}/{name}": text for name, text in command_pages.pages().items()}


def on_files(files: Files, config: Any) -> Files:
    """Add the pages of commands, what the pages link to outside docs/, and what those files link to."""
    for name, text in made_pages().items():
        files.append(File.generated(config, name, content=text))
    made = [path for name, text in made_pages().items() for path in outside_targets(DOCS / name, text)]
    pages = [Path(file.abs_src_path) for file in files.documentation_pages() if file.abs_src_path] + made
    pages += [ROOT / path for path in nav_paths(config["nav"])]
    known: set[Path] = set()
    while pages:
        page = pages.pop()
        found = {page} if not page.is_relative_to(DOCS) else set()
        if page.suffix == ".md":
            found |= set(outside_targets(page, page.read_text("utf-8")))
        for path in found - known:
            known.add(path)
            files.append(File.generated(config, site_path(path), abs_src_path=str(path)))
            pages.append(path)
    for place, path in example_files().items():
        files.append(File.generated(config, site_path(place), abs_src_path=str(path)))
    return files


def example_files() -> dict[Path, Path]:
    """{place: file} of what EXAMPLE loads."""
    if not (built := [path for path in (WEB / "dist").glob("*") if path.is_file()]):
        raise PluginError("the web player is not built: make docs")
    style = EXAMPLE / "page.css"
    return {style: style} | {EXAMPLE / "avatar-export-player" / path.name: path for path in built}


def on_page_markdown(markdown: str, page: Any, config: Any, files: Files) -> str:
    """Point links at where the site has their targets."""
    source = Path(page.file.abs_src_path or DOCS / page.file.src_uri)

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


def outside_targets(page: Path, text: str) -> list[Path]:
    """Existing files outside docs/ that a page with this text links to."""
    found: list[Path] = []

    def note(text: str) -> str:
        paths = (target_of(page, match[2].partition("#")[0]) for match in LINK.finditer(text))
        found.extend(path for path in paths if path and not path.is_relative_to(DOCS))
        return text

    outside_code(text, note)
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
