"""Compiles HLSL with Microsoft's compiler, which Wine runs: one start for all texts, kept programs, nothing skipped
without a word."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock
from tools.windows import wine
from tools.windows.compiler import compiler
from tools.zig import compiled

from tests.session.needed import need

SOURCE = Path(__file__).with_name("fxc.c")
TARGETS = {"compute": "cs_5_0", "vertex": "vs_5_0", "fragment": "ps_5_0"}
MICROSOFT = "Microsoft (R) HLSL Shader Compiler "
_INCLUDE = re.compile(r'^\s*#include "(.+)"$')
_PRAGMA = re.compile(r"^\s*#pragma .*$", re.MULTILINE)  # for Unity, which takes them out


@dataclass(frozen=True)
class Text:
    """An entry of an HLSL text."""

    name: str  # that a failed test shows
    entry: str
    kind: str  # compute, vertex or fragment
    text: str


@dataclass(frozen=True)
class Result:
    """What Microsoft's compiler makes of a text."""

    good: bool
    compiled_by: str  # as the bytecode has it
    said: str


def flat(file: Path, folders: Sequence[Path], text: str | None = None) -> str:
    """A text with its includes, which are looked for beside it, then in the folders. Lines keep their numbers."""
    lines = []
    for number, line in enumerate((text or file.read_text("utf-8")).splitlines(), 2):
        found = _INCLUDE.match(line)
        if found:
            name = found[1].lstrip("/")
            inner = next(
                path for path in (place / name for place in (file.parent, *folders)) if path.exists()
            )
            lines += [flat(inner, folders), f'#line {number} "{file.name}"']
        else:
            lines.append(_PRAGMA.sub("", line))
    return "\n".join([f'#line 1 "{file.name}"', *lines])


def compile_all(texts: Sequence[Text], folder: Path) -> tuple[Path, list[Result], float]:
    """The library that answered, what it said of each text, and the CPU seconds of Wine. Skips without Wine."""
    rows = []
    for number, one in enumerate(texts):
        file = folder / f"{number}.hlsl"
        file.write_text(one.text, "utf-8", newline="\n")
        rows.append(f"{TARGETS[one.kind]} {one.entry} {file}\n")
    (folder / "list").write_text("".join(rows))
    try:
        library = compiler()
        said = wine.run([program(), wine.windows_path(library), folder / "list"])
    except wine.Missing as error:
        need({f"Wine or its compiler ({error})": None})
    assert said.code == 0, said
    answered, *parts = said.out.split("\f")
    results = [Result(*_parsed(part)) for part in parts]
    assert len(results) == len(texts), said
    return Path(answered.strip().removeprefix("Z:").replace("\\", "/")), results, said.cpu_s


def _parsed(part: str) -> tuple[bool, str, str]:
    code, compiled_by, said = part.split("\n", 2)
    return code == "00000000", compiled_by, said.strip()


def program() -> Path:
    """fxc.exe, kept until its source changes."""
    made = wine.folder() / "fxc.exe"
    with FileLock(made.with_suffix(".lock")):
        if not made.exists() or made.stat().st_mtime < SOURCE.stat().st_mtime:
            compiled(made, "x86_64-windows-gnu", ["-O1", "-s", "-Wall", "-Wextra", "-Werror", SOURCE], "cc")
    return made
