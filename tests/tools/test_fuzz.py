"""Hostile copies of every kind of file are refused in one line or read soundly; what was found once stays found."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random

import pytest
from tools.fuzz.attack import CORPUS, REFUSED, SOUND, Arena, attack, judged
from tools.fuzz.targets import TARGETS

from tests.session.shared_folder import made_once

CASES = 300  # of a target
FOUND = sorted(path.parent.relative_to(CORPUS).as_posix() for path in CORPUS.glob("*/*/finding.text"))


@pytest.fixture
def arena(tmp_path_factory: pytest.TempPathFactory, tmp_path: Path, request: pytest.FixtureRequest) -> Arena:
    """The sound inputs of a target, made once for all workers; copies of its own."""
    name: str = request.param
    made = made_once(
        tmp_path_factory, f"fuzz_{name.replace(' ', '_')}", lambda folder: Arena(name, folder).good.parent
    )
    found = Arena(name, made)
    found.scratch = tmp_path
    return found


@pytest.mark.parametrize("arena", TARGETS, indirect=True)
def test_hostile_inputs_are_refused_or_sound(arena: Arena) -> None:
    outcomes = [(n, attack(arena, 0, n, corpus=None)) for n in range(CASES)]
    assert not [f"input {n}: {outcome.kind}: {outcome.text}" for n, outcome in outcomes if outcome.text]
    kinds = Counter(outcome.kind for _, outcome in outcomes)
    assert kinds[SOUND] and kinds[REFUSED], "the attack is too weak or too strong"


@pytest.mark.parametrize("arena", TARGETS, indirect=True)
def test_what_is_not_changed_is_sound(arena: Arena) -> None:
    assert {name: judged(arena.target, arena.good / name).kind for name in arena.inputs} == dict.fromkeys(
        arena.inputs, SOUND
    )


@pytest.mark.parametrize(
    ("arena", "place"), [(at.partition("/")[0], at) for at in FOUND], ids=FOUND, indirect=["arena"]
)
def test_a_finding_stays_mended(arena: Arena, place: str) -> None:
    folder = CORPUS / place
    changed = {
        path.relative_to(folder): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "finding.text"
    }
    name = folder.name.rpartition("-")[0]
    copy = arena.lay(name, {}, Random(0))
    for path, data in changed.items():
        (copy / path).write_bytes(data)
    outcome = judged(arena.target, copy)
    assert not outcome.text, outcome.text
