"""How TypeScript, C# and C++ are laid out: imports, folders and files of what is written by hand.

TypeScript and C++ import files. C# imports namespaces, and its assemblies name one another in .asmdef files.
"""

from __future__ import annotations

import json
import os
import posixpath
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from tools.structure import ROOT, circles

FOLDERS = ("players", "tests", "bench")
LANGUAGES = {".ts": "TypeScript", ".mjs": "TypeScript", ".cs": "C#", ".cpp": "C++", ".h": "C++"}
LEFT_OUT = {"node_modules", "dist", "build", "out"}  # what others write, and what is built
NOT_BY_HAND = {"made", "data"}  # folders: what programs make, and what tests compare with
MARK = re.compile(r"\bMade (by|from|of)\b[^\n]*do not edit")  # in the head of a made file that lies elsewhere
INCLUDED = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)
IMPORTED = re.compile(
    r"""(?:^(?:import|export)\b[^;"']*?|\bimport\()["'](?:inline-worker:)?(\.[^"']+)["']""", re.MULTILINE
)
NAMESPACE = re.compile(r"^namespace ([\w.]+)", re.MULTILINE)
USING = re.compile(r"^using (?:static )?([\w.]+);", re.MULTILINE)


@cache
def files() -> dict[str, str]:
    """Path below the root -> text of every file that is written by hand."""
    found = {}
    for folder in FOLDERS:
        for above, folders, names in os.walk(ROOT / folder):
            folders[:] = [
                name for name in folders if name not in LEFT_OUT and name.lower() not in NOT_BY_HAND
            ]
            for path in (Path(above, name) for name in names if Path(name).suffix in LANGUAGES):
                text = path.read_text("utf-8-sig")
                if not MARK.search(text[:400]):
                    found[path.relative_to(ROOT).as_posix()] = text
    return dict(sorted(found.items()))


def file_circles() -> list[list[str]]:
    """Sets of files of TypeScript or C++ that import each other in a circle; an import of types counts."""
    return circles({path: set(_imports(path, text)) for path, text in files().items()})


def namespace_circles() -> list[list[str]]:
    """The same of C#'s namespaces."""
    graph: dict[str, set[str]] = {}
    for path, text in files().items():
        if LANGUAGES[Path(path).suffix] == "C#":
            for name in NAMESPACE.findall(text):
                graph.setdefault(name, set()).update(set(USING.findall(text)) - {name})
    return circles(graph)


def assembly_circles() -> list[list[str]]:
    """The same of C#'s assemblies, by what their definitions refer to."""
    read = (json.loads(path.read_text("utf-8-sig")) for path in (ROOT / "players").rglob("*.asmdef"))
    return circles({given["name"]: set(given.get("references", ())) for given in read})


def full_folders() -> dict[str, int]:
    """Folders and how many files each holds, the fullest first."""
    count: dict[str, int] = {}
    for path in files():
        folder = posixpath.dirname(path)
        count[folder] = count.get(folder, 0) + 1
    return dict(sorted(count.items(), key=lambda item: -item[1]))


def long_files() -> dict[str, int]:
    """Files and their lines, the longest first."""
    lines = {path: len(text.splitlines()) for path, text in files().items()}
    return dict(sorted(lines.items(), key=lambda item: -item[1]))


def _imports(path: str, text: str) -> Iterator[str]:
    pattern = {"TypeScript": IMPORTED, "C++": INCLUDED}.get(LANGUAGES[Path(path).suffix])
    for name in pattern.findall(text) if pattern else ():
        beside = posixpath.normpath(posixpath.join(posixpath.dirname(path), name))
        choices = {beside, re.sub(r"\.js$", ".ts", beside)} & files().keys()
        yield from choices or _included(path, name)


def _included(path: str, name: str) -> Iterator[str]:
    """What a C++ file of a player includes from one of the compiler's include folders."""
    player = "/".join(path.split("/")[:2])
    yield from (other for other in files() if other.startswith(player) and other.endswith(f"/{name}"))
