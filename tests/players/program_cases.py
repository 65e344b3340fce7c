"""Changed programs, sound and unsound, as JSON, with what Python's checker says of each."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Callable, Iterable
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.check import check_program
from avatar_runtime.program.model import Buffer, Pass, Program, Section
from tests.runtime.program.coded import programs
from tests.runtime.program.mutations import constants, contents, structure
from tests.runtime.program.test_check_named import REFUSED, long_row

PROGRAMS = programs()
NOT_FINITE = {"nan": "NaN", "inf": "Infinity"}


def write_programs(path: Path) -> None:
    """All of them. Buffers, sections and passes that several programs share are written once."""
    writer = _Writer()
    for name, change, _, message in REFUSED:
        program, groups = PROGRAMS[name]
        writer.add(change(program), groups, message)
    writer.add(*long_row(), "gives a row 65537 entries; 65536 are the most")
    for name, (program, groups) in PROGRAMS.items():
        writer.add(program, groups)
        rng, whole = np.random.default_rng(15), name in ("full coded", "surface", "lit")
        for made in mutations(program, rng, whole=whole):
            writer.add(made(), groups)
    path.write_text(json.dumps(writer.done()))


def mutations(program: Program, rng: np.random.Generator, *, whole: bool) -> Iterable[Callable[[], Program]]:
    """Of all changes of one thing, such as one constant of one entry, a random one."""
    found: dict[str, list[Callable[[], Program]]] = {}
    makers = [constants, contents, structure] if whole else [structure]
    for what, _, change in chain(*(make(program) for make in makers)):
        found.setdefault(what, []).append(change)
    return [changes[rng.integers(len(changes))] for changes in found.values()]


class _Writer:
    def __init__(self) -> None:
        self.lists: dict[str, list[Any]] = {"sections": [], "buffers": [], "passes": [], "programs": []}
        self._known: dict[tuple[str, int], int] = {}
        self._kept: list[object] = []  # so that no id is used twice

    def add(self, program: Program, groups: int, message: str = "") -> None:
        """A program with Python's verdict. What TypeScript's types do not let through is left out."""
        if not _typed(program):
            return
        self.lists["programs"].append(
            {
                "groups": groups,
                "buffers": [[name, self._buffer(buffer)] for name, buffer in program.buffers.items()],
                "mesh": self._passes(program.mesh),
                "levels": [
                    {
                        "prefix": level.prefix,
                        "chunks": [{"first": run.first, "count": run.count} for run in level.chunks],
                        "deform": self._passes(level.deform),
                        "view": self._passes(level.view),
                        "shadow": self._passes(level.shadow),
                        "light": self._passes(level.light),
                    }
                    for level in program.levels
                ],
                "pose": dict(program.pose),
                "poseFloats": program.pose_floats,
                "readsMesh": program.reads_mesh,
                "message": message,
                "field": verdict(program, groups),
            }
        )

    def done(self) -> dict[str, list[Any]]:
        """All lists."""
        return self.lists

    def _once(self, which: str, value: Any, made: Callable[[], Any]) -> int:
        key = (which, id(value))
        if key not in self._known:
            self._kept.append(value)
            self._known[key] = len(self.lists[which])
            self.lists[which].append(made())
        return self._known[key]

    def _passes(self, passes: Iterable[Pass]) -> list[int]:
        return [self._once("passes", one, partial(_pass, one)) for one in passes]

    def _buffer(self, buffer: Buffer) -> int:
        sections = [self._once("sections", s, partial(_section, s)) for s in buffer.sections]
        return self._once("buffers", buffer, lambda: [buffer.name, buffer.size, sections])


def _typed(program: Program) -> bool:
    sections = [section for buffer in program.buffers.values() for section in buffer.sections]
    texts = [text for one in program.passes() for text in (one.entry, *one.buffers.values())]
    whole = [
        value
        for one in program.passes()
        for name, value in one.constants.items()
        if isinstance(value, float) and value.is_integer() and name == "count"
    ]
    return (
        not whole  # JavaScript has one type of number
        and all(s.elements.ndim == 1 and s.elements.dtype.kind == "u" for s in sections)
        and all(isinstance(text, str) for text in (*texts, *program.buffers))
    )


def _section(section: Section) -> list[Any]:
    return [section.name, section.width, base64.b64encode(section.elements.tobytes()).decode()]


def _pass(one: Pass) -> dict[str, Any]:
    constants = {
        name: NOT_FINITE[str(value)] if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in one.constants.items()
    }
    return {"entry": one.entry, "rows": one.rows, "buffers": dict(one.buffers), "constants": constants}


def verdict(program: Program, groups: int) -> str | None:
    """The field that Python's checker names; None for a sound program."""
    try:
        check_program(program, groups)
    except AvatarError as error:
        return error.field
    return None
