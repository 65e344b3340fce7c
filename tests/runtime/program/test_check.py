"""No program that the checker accepts leaves its buffers, whatever is changed in it; what it refuses, it names."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from itertools import chain

import numpy as np
import pytest

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.bake import bake
from avatar_runtime.program.check import check_program
from avatar_runtime.program.model import Buffer, Pass, Program
from avatar_runtime.program.passes import PADDING, interfaces
from tests.avatars import full_avatar, surface_avatar
from tests.oracles.kernel_accesses import KERNELS, Harm, guarded, key, run, walk
from tests.runtime.backends.gl_cases import avatars
from tests.runtime.program.coded import programs
from tests.runtime.program.mutations import (
    Mutation,
    constants,
    contents,
    structure,
)

PROGRAMS = programs()
Change = Callable[[Program], Program]


def accepted(program: Program, groups: int) -> bool:
    try:
        check_program(program, groups)
    except AvatarError as error:
        assert "\n" not in str(error) and error.field, error
        return False
    return True


def harmful(program: Program, sound: frozenset[tuple[int, ...]] = frozenset()) -> bool:
    try:
        walk(program, sound)
    except Harm:
        return True
    return False


@pytest.mark.parametrize("limit", [6000, 1 << 27])
def test_programs_of_all_rules_are_accepted(limit: int) -> None:
    for avatar in (*avatars().values(), full_avatar(1), surface_avatar(1)):
        check_program(bake(avatar, limit=limit), len(avatar.groups))


@pytest.mark.parametrize("name", PROGRAMS)
def test_coded_programs_are_accepted_and_harmless(name: str) -> None:
    program, groups = PROGRAMS[name]
    check_program(program, groups)
    walk(program)


def test_these_programs_have_every_entry_and_width() -> None:
    found = [one for program, _ in PROGRAMS.values() for one in program.passes()]
    assert {one.entry for one in found} == set(KERNELS)
    for entry in KERNELS:
        access = interfaces()[entry]["access"]
        for name, told in access.get("sections", {}).items():
            if told["kind"] in ("linear", "signed", "weight", "table"):
                widths = {one.constants[told["width"]] for one in found if one.entry == entry}
                assert len(widths) >= 3, (entry, name, widths)


def test_the_oracle_sees_every_section_and_buffer() -> None:
    """A section that begins where its buffer ends, and a buffer of no bytes, do harm in each kernel."""
    found, wanted = set(), set()
    for program, _ in PROGRAMS.values():
        for one in program.passes():
            access = interfaces()[one.entry]["access"]
            ends = {n: program.buffers[bound].size // 4 for n, bound in one.buffers.items()}
            sections = access.get("sections", {}).items()
            begins = {name: told["buffer"] for name, told in sections}
            begins |= {told["scale"]: told["buffer"] for _, told in sections if "scale" in told}
            tries = {n: replace(one, constants={**one.constants, n: ends[b]}) for n, b in begins.items()}
            for name, changed in (tries | {name: one for name in one.buffers}).items():
                wanted.add((one.entry, name))
                if (one.entry, name) not in found:
                    buffers = dict(program.buffers)
                    if name in one.buffers:
                        buffers[one.buffers[name]] = Buffer(one.buffers[name], 0)
                    found |= {(one.entry, name)} if does_harm(changed, buffers) else set()
    assert sorted(wanted - found) == []


def does_harm(one: Pass, buffers: Mapping[str, Buffer]) -> bool:
    """Of one pass alone; every triangle has vertices 0, 1 and the last."""
    held = guarded(buffers)
    if "Triangles" in one.buffers:
        count, vertices = one.count("triangles"), one.count("vertices")
        triangles = held[one.buffers["Triangles"]]
        triangles.held = {2 * count + i: (0, 1, vertices - 1) for i in range(count)}
    try:
        run(one, held)
    except Harm:
        return True
    return False


@pytest.mark.parametrize("name", PROGRAMS)
def test_what_is_accepted_after_a_change_is_harmless(name: str) -> None:
    """Every constant, index, pointer, length, size, binding and place of a pass, judged by walking the kernels."""
    program, groups = PROGRAMS[name]
    sound = frozenset(key(one, program.buffers) for one in program.passes())
    rng = np.random.default_rng(14)
    tried, kept = 0, 0
    makers = [structure] if name in ("chunks", "two levels") else [constants, contents, structure]
    for what, change in _one_of_each(chain(*(make(program) for make in makers)), rng):
        changed = change()
        tried += 1
        if accepted(changed, groups):
            kept += 1
            assert not harmful(changed, sound), what
    assert tried > 40 and kept < tried / 4


def _one_of_each(
    mutations: Iterable[Mutation], rng: np.random.Generator
) -> list[tuple[str, Callable[[], Program]]]:
    """Of all changes of one thing, such as one constant of one entry, a random one."""
    found: dict[str, list[tuple[str, Callable[[], Program]]]] = {}
    for what, exactly, change in mutations:
        found.setdefault(what, []).append((exactly, change))
    return [changes[rng.integers(len(changes))] for changes in found.values()]


def test_every_constant_that_indices_depend_on_is_in_the_contract() -> None:
    for entry in KERNELS:
        row = interfaces()[entry]
        told = set(re.findall(r"\w+", json.dumps(row["access"])))
        members = [m for block in row["uniform_blocks"] for m in block["members"]]
        whole = {m["name"] for m in members if m["type"] == "uint"} - {PADDING}
        assert whole <= told, entry
        assert {item["name"] for item in row["storage"]} - {"Pose"} <= told, entry
