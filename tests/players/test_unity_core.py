"""The core of the Unity player under mono, judged by what Python computes."""

from __future__ import annotations

from pathlib import Path

import pytest

from avatar_export import read
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from tests.players.unity import UNITY, compile_csharp, core_sources, core_tests, run_core_tests
from tests.players.unity_cases import write_contents
from tests.runtime.backends.gl_cases import avatars

FIXTURES = (
    "AllocationTests",
    "BoneTests",
    "CameraTests",
    "ClipTests",
    "ConformTests",
    "ContentTests",
    "HostileTests",
    "PackTests",
    "PacketTests",
    "PlayTests",
    "PoseTests",
    "ProgramTests",
    "ProxyMeshTests",
    "RecordingTests",
)
ELSEWHERE = {"IconTests"}  # test_unity_editor.py has their cases
MADE_UP = {"HostileTests": pytest.mark.hypothesis}  # which `make fuzz` repeats with more
TRAINED = Path(__file__).parents[2] / "samples" / "trained"
LARGER = ("head_blendshapes", "head_points", "head_splatting")  # which take long to pack
COARSE = Fineness(4.0)
GOLDEN = Path(__file__).parents[1] / "data" / "packs" / "1.0"


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All tests of the core, compiled."""
    return core_tests(tmp_path_factory)


def test_all_tests_of_the_core_are_listed() -> None:
    files = {path.stem for path in (UNITY / "Tests" / "Core").glob("*Tests.cs")}
    assert files == {*FIXTURES, *ELSEWHERE}


@pytest.mark.parametrize("name", [pytest.param(name, marks=MADE_UP.get(name, ())) for name in FIXTURES])
def test_mono_finds_what_python_computes(name: str, program: Path, unity_cases: Path) -> None:
    printed = run_core_tests(program, name, AVATAR_CASES=str(unity_cases))
    print(printed)


def test_conformance_avatars_hold_what_python_reads(program: Path, tmp_path: Path) -> None:
    write_contents({name: pack([avatar], None).file for name, avatar in avatars().items()}, tmp_path)
    run_core_tests(program, "ContentTests", AVATAR_CASES=str(tmp_path))


@pytest.mark.parametrize(
    "name", ["body_splatting", *(pytest.param(name, marks=pytest.mark.players) for name in LARGER)]
)
def test_samples_hold_what_python_reads(name: str, program: Path, tmp_path: Path) -> None:
    write_contents({name: pack([read(TRAINED / name)], COARSE).file}, tmp_path)
    run_core_tests(program, "ContentTests", AVATAR_CASES=str(tmp_path))


def test_every_public_name_of_the_core_is_explained(tmp_path: Path) -> None:
    told = tmp_path / "core.xml"  # a name without a comment is a warning
    compile_csharp(core_sources(), tmp_path / "core.dll", f"-doc:{told}")


def test_golden_packs_of_the_package_are_those_of_the_tests() -> None:
    copies = sorted((UNITY / "Tests" / "Core" / "Packs").glob("*.avatar.bytes"))
    assert copies
    for copy in copies:
        assert copy.read_bytes() == (GOLDEN / copy.name.removesuffix(".bytes")).read_bytes()
