"""No program that the checker accepts leaves its buffers, whatever is changed in it; what it refuses, it names."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable
from itertools import chain

import numpy as np
import pytest

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.bake import bake
from avatar_runtime.program.check import check_program
from avatar_runtime.program.model import Program
from avatar_runtime.program.passes import PADDING, interfaces
from tests.avatars import full_avatar, surface_avatar
from tests.oracles.kernel_accesses import KERNELS, Harm, key, walk
from tests.runtime.backends.gl_cases import avatars
from tests.runtime.program.coded import programs
from tests.runtime.program.mutations import Mutation, constants, contents, structure

PROGRAMS = programs()


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
