"""The core of the Unity player under mono, judged by what Python computes."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path

import pytest
from tools.fuzz.readers import difference

from avatar_export import read
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from tests.players.hostile.judge_python import judged
from tests.players.hostile.judges import unity
from tests.players.unity import UNITY, core_sources, program_of_tests, run_tests, sources
from tests.players.unity_cases import write_contents
from tests.runtime.backends.gl_cases import avatars

TESTS = UNITY / "Tests" / "Core"
HOSTILE = "HostileTests"  # which `make fuzz` repeats with more
ELSEWHERE = {HOSTILE, "IconTests"}  # test_unity_editor.py has the cases of icons
TRAINED = Path(__file__).parents[2] / "samples" / "trained"
LARGER = ("head_blendshapes", "head_points", "head_splatting")  # which take long to pack
GOLDEN = Path(__file__).parents[1] / "data" / "packs" / "1.0"


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All tests of the core, compiled."""
    return program_of_tests(
        tmp_path_factory, "unity_core_tests", lambda _: [*core_sources(), *sources(TESTS)]
    )


def test_mono_finds_what_python_computes(program: Path, unity_cases: Path) -> None:
    fixtures = {path.stem for path in TESTS.glob("*Tests.cs")} - ELSEWHERE
    printed = run_tests(program, *fixtures, AVATAR_CASES=str(unity_cases))
    assert {
        line.split()[1].split(".")[0] for line in printed.splitlines() if line.startswith("ok ")
    } == fixtures


@pytest.mark.hypothesis
def test_hostile_packs_are_refused(program: Path, unity_cases: Path) -> None:
    print(run_tests(program, HOSTILE, AVATAR_CASES=str(unity_cases)))


def test_the_judge_says_of_golden_packs_what_python_says(tmp_path: Path) -> None:
    packs = [path.read_bytes() for path in sorted(GOLDEN.glob("*.avatar"))]
    given = b"".join(len(file).to_bytes(4, "little") + file for file in (*packs, b"no pack"))
    done = subprocess.run(unity(tmp_path), input=given, stdout=subprocess.PIPE, check=True)
    *found, last = map(json.loads, done.stdout.splitlines())
    assert last == {"ok": False, "why": "x.avatar: is not a pack: it does not begin as a gzip file"}
    for file, said in zip(packs, found, strict=True):
        assert said["ok"] and difference({"python": judged(file), "unity": said}) == ""


def test_conformance_avatars_hold_what_python_reads(program: Path, tmp_path: Path) -> None:
    write_contents({name: pack([avatar], None).file for name, avatar in avatars().items()}, tmp_path)
    run_tests(program, "ContentTests", AVATAR_CASES=str(tmp_path))


@pytest.mark.parametrize(
    "name", ["body_splatting", *(pytest.param(name, marks=pytest.mark.players) for name in LARGER)]
)
def test_samples_hold_what_python_reads(name: str, program: Path, tmp_path: Path) -> None:
    write_contents({name: pack([read(TRAINED / name)], Fineness(4.0)).file}, tmp_path)
    run_tests(program, "ContentTests", AVATAR_CASES=str(tmp_path))


def test_golden_packs_of_the_package_are_those_of_the_tests() -> None:
    copies = sorted((TESTS / "Packs").glob("*.avatar.bytes"))
    assert copies
    for copy in copies:
        assert copy.read_bytes() == (GOLDEN / copy.name.removesuffix(".bytes")).read_bytes()
