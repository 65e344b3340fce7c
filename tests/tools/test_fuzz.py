"""Hostile copies of every kind of file are refused in one line or read soundly; what was found once stays found."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from random import Random

import pytest
from tools.fuzz import attack as attacks
from tools.fuzz import run as runs
from tools.fuzz.attack import CORPUS, CRASH, GREEDY, HANG, REFUSED, SOUND, Arena, attack, judged
from tools.fuzz.targets import TARGETS, Target

from avatar_runtime.io.errors import AvatarError
from tests.session.shared_folder import made_once

CASES = 300  # of a target
PACKS = 2000
SHARES = {"pack": 8, "validate": 2}  # of the inputs, so that they are spread over workers
ATTACKS = [(name, share) for name in TARGETS for share in range(SHARES.get(name, 1))]
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


@pytest.mark.parametrize(("arena", "share"), ATTACKS, indirect=["arena"])
def test_hostile_inputs_are_refused_or_sound(arena: Arena, share: int) -> None:
    every = PACKS if arena.name == "pack" else CASES
    count = every // SHARES.get(arena.name, 1)
    outcomes = [(n, attack(arena, 0, n, corpus=None)) for n in range(share * count, (share + 1) * count)]
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


def refuse(_: Path) -> object:
    raise AvatarError("is too long", file="x" * 4000)


def misread(folder: Path) -> object:
    """Crashes, hangs, takes memory or dies, as the first byte says."""
    what = (folder / "byte").read_bytes()[:1]
    if what == b"c":
        raise KeyError("x")
    if what == b"h":
        while True:
            pass
    if what == b"m":
        return len(os.urandom(1) * (600 << 20))
    if what == b"d":
        os._exit(7)
    if what == b"l":
        return refuse(folder)
    return None


def made(folder: Path) -> None:
    (folder / "one").mkdir()
    (folder / "one" / "byte").write_bytes(b"x")


def test_every_kind_of_finding_is_found_and_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    letters = iter("cxlmhdx")
    monkeypatch.setitem(TARGETS, "made up", Target(made, misread))
    monkeypatch.setattr(attacks, "SECONDS", 2.0)
    monkeypatch.setattr(attacks, "mutated", lambda *_: next(letters).encode())
    monkeypatch.setattr(runs, "CHUNK", 6)
    (found,) = runs.run({"made up": 6}, tmp_path / "work", workers=1, corpus=tmp_path / "corpus").values()
    assert (found.sound, found.refused, found.crashes, found.hangs, found.greedy) == (1, 0, 3, 1, 1)
    kept = [path.read_text().split("\n")[0] for path in tmp_path.glob("corpus/made up/one-*/finding.text")]
    assert Counter(kept) == {CRASH: 3, HANG: 1, GREEDY: 1}
    files = [path.read_bytes() for path in tmp_path.glob("corpus/made up/one-*/byte")]
    assert sorted(files) == [b"c", b"d", b"h", b"l", b"m"]


def test_the_same_number_gives_the_same_input(tmp_path: Path) -> None:
    arena = Arena("meshes", tmp_path)
    draws = [attacks.hostile(arena, Random(f"meshes/0/{n}")) for n in (1, 1, 2)]
    assert draws[0] == draws[1] != draws[2]
