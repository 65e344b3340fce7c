"""One change at a time to a sound program: constants, rows, bindings, sizes, indices, pointers, the order of passes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from avatar_runtime.program.model import Buffer, Constant, Pass, Program, Run, Section

Spot = tuple[str, int, int]  # list, level, index
Mutation = tuple[str, str, Callable[[], Program]]  # what is changed, exactly how, the changed program
WIDE = (1 << 31, (1 << 32) - 1, (1 << 32) // 3 + 1)  # whose products wrap around
RAISED = ("_column", "corners", "triangle_ids", "vertex_triangle", "base_opacity")


def spots(program: Program) -> Iterator[tuple[Spot, Pass]]:
    """Where each pass stands."""
    for index, one in enumerate(program.mesh):
        yield ("mesh", 0, index), one
    for at, level in enumerate(program.levels):
        for which in ("deform", "view", "shadow", "light"):
            for index, one in enumerate(getattr(level, which)):
                yield (which, at, index), one


def with_list(program: Program, spot: Spot, change: Callable[[list[Pass]], object]) -> Program:
    """The program with a changed list of passes."""
    which, at, _ = spot
    if which == "mesh":
        passes = list(program.mesh)
        change(passes)
        return replace(program, mesh=tuple(passes))
    passes = list(getattr(program.levels[at], which))
    change(passes)
    levels = list(program.levels)
    levels[at] = replace(levels[at], **{which: tuple(passes)})
    return replace(program, levels=tuple(levels))


def with_pass(program: Program, spot: Spot, **changed: Any) -> Program:
    """The program with other fields in one pass."""

    def change(passes: list[Pass]) -> None:
        passes[spot[2]] = replace(passes[spot[2]], **changed)

    return with_list(program, spot, change)


def with_constant(program: Program, spot: Spot, one: Pass, name: str, value: Constant) -> Program:
    """The program with another constant in one pass."""
    return with_pass(program, spot, constants={**one.constants, name: value})


def with_buffer(program: Program, name: str, **changed: Any) -> Program:
    """The program with other fields in one buffer."""
    return replace(program, buffers={**program.buffers, name: replace(program.buffers[name], **changed)})


def with_elements(program: Program, buffer: str, name: str, change: Callable[[Any], Any]) -> Program:
    """The program with other elements in a section; constants that other sections begin at follow."""
    held = program.buffers[buffer]
    sections = tuple(
        Section(s.name, change(s.elements.copy())) if s.name == name else s for s in held.sections
    )
    made = Buffer(buffer, 4 * sum(s.words for s in sections), sections)
    found = replace(program, buffers={**program.buffers, buffer: made})
    offsets = made.offsets()
    for spot, one in spots(program):
        if buffer in one.buffers.values():
            moved = {k: offsets[k] for k in one.constants.keys() & offsets.keys()}
            found = with_pass(found, spot, constants={**one.constants, **moved})
    return found


def constants(program: Program) -> Iterator[Mutation]:
    """Other values of every constant of every pass."""
    for spot, one in spots(program):
        for name, value in one.constants.items():
            for other in _others(value, name):
                change = partial(with_constant, program, spot, one, name, other)
                yield f"{one.entry} {name}", f"{spot} {one.entry} {name} = {other}", change


def _others(value: Constant, name: str) -> Sequence[Constant]:
    if isinstance(value, str):
        return [f"{value}[0]", "world_row9", float("nan"), "group_matrix_row0[99]"]
    if isinstance(value, float):
        return [float("nan"), 1e39, -0.5, "eye"]
    if isinstance(value, tuple):
        return [value[:3], (*value[:3], 1e39), 1.0, "eye"]
    assert isinstance(value, int)
    pool = (value + 1, value - 1, 0, 2 * value + 64, *WIDE)
    if name.endswith("_width"):
        pool = (0, 8, 16, 32, 1, 33, 40)
    return [other for other in dict.fromkeys(pool) if other != value]


def contents(program: Program) -> Iterator[Mutation]:
    """Every section that indices depend on: too large a number, and what a pointer must not do; every length."""
    for name, buffer in program.buffers.items():
        kind = name.split(".")[0]
        for section in buffer.sections:
            for what, change in _changes(section):
                made = partial(with_elements, program, name, section.name, change)
                yield f"{kind} {section.name} {what}", f"{name} {section.name} {what}", made


def _changes(section: Section) -> Iterator[tuple[str, Callable[[Any], Any]]]:
    elements = section.elements
    if section.name.endswith("_ptr"):
        yield "begins at 1", _put(0, 1)
        yield "falls", _put(1, 1 << 20)
        yield "ends too late", _put(-1, int(elements[-1]) + 1)
    elif section.name.endswith(RAISED) and elements.size:
        most = int(np.iinfo(elements.dtype).max)
        yield "holds one more", _put(elements.size // 2, min(int(elements.max()) + 1, most))
        yield "holds the largest number", _put(0, most)
    if elements.size:
        yield "is shorter", lambda e: e[:-1]


def _put(at: int, value: int) -> Callable[[Any], Any]:
    def change(elements: Any) -> Any:
        elements[at] = value
        return elements

    return change


def structure(program: Program) -> Iterator[Mutation]:
    """Rows, bindings, sizes, and the order of passes."""
    for spot, one in spots(program):
        at, i = f"{spot} {one.entry}", spot[2]
        for rows in (one.rows - 1, one.rows + 1, 1 << 31):
            yield f"{one.entry} rows", f"{at} rows {rows}", partial(with_pass, program, spot, rows=rows)
        moves: dict[str, Callable[[list[Pass]], object]] = {
            "is gone": lambda passes, i=i: passes.pop(i),
            "comes last": lambda passes, i=i: passes.append(passes.pop(i)),
            "comes first": lambda passes, i=i: passes.insert(0, passes.pop(i)),
        }
        for what, move in moves.items():
            yield f"{one.entry} {what}", f"{at} {what}", partial(with_list, program, spot, move)
        for name in one.buffers:
            for other in sorted(program.buffers.keys() - {one.buffers[name]}):
                buffers = {**one.buffers, name: other}
                change = partial(with_pass, program, spot, buffers=buffers)
                yield f"{one.entry} {name} is another", f"{at} {name} is {other}", change
    for name, buffer in program.buffers.items():
        if buffer.sections:
            yield "no sections", f"{name} has no sections", partial(with_buffer, program, name, sections=())
        for size in (buffer.size - 16, buffer.size + 16, 0):
            if 0 <= size != buffer.size and not buffer.sections:
                change = partial(with_buffer, program, name, size=size)
                yield f"{name.split('.')[0]} size", f"{name} has {size} bytes", change
    for index, level in enumerate(program.levels):
        for chunk, run in enumerate(level.chunks):
            for count in (run.count + 1, run.count - 1):
                change = partial(with_chunk, program, index, chunk, replace(run, count=count))
                yield "chunk rows", f"chunk {chunk} has {count} rows", change


def with_chunk(program: Program, level: int, chunk: int, run: Run) -> Program:
    """The program with another run in the place of a chunk."""
    levels, chunks = list(program.levels), list(program.levels[level].chunks)
    chunks[chunk] = run
    levels[level] = replace(levels[level], chunks=tuple(chunks))
    return replace(program, levels=tuple(levels))
