"""The native player compiles everywhere that can be asked here; its page's program runs; libFuzzer finds nothing."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from tools.fuzz.native import PACKS, executions, fuzz, try_once
from tools.fuzz.native_seeds import tiny

from tests.players.native import need_compilers, page_program, run
from tests.session.fuzz import FACTOR
from tests.session.native import LANGUAGE, LIMIT_S, NATIVE, SANITIZED, WARNINGS, build, includes, one_unit

TARGETS = ("x86_64-linux-gnu", "aarch64-linux-gnu", "x86_64-windows-gnu", "x86_64-macos", "aarch64-macos")
SECONDS = 5


def compiled(command: list[str]) -> None:
    """Fails the test with what the compiler says."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-4000:]


@pytest.mark.parametrize("standard", ["c99", "c17", "c++17"])
def test_the_header_is_c_and_cpp(standard: str, tmp_path: Path) -> None:
    need_compilers()
    unit = tmp_path / ("unit.cpp" if "+" in standard else "unit.c")
    unit.write_text('#include "avatar_player.h"\n#include "avatar_player.h"\n')
    for compiler in ("gcc", "clang"):
        flags = [f"-std={standard}", "-pedantic", "-Wall", "-Wextra", "-Werror", "-fsyntax-only"]
        compiled([compiler, *flags, f"-I{NATIVE / 'include'}", str(unit)])


def test_gcc_takes_the_library_without_a_warning(tmp_path: Path) -> None:
    need_compilers()
    unit = tmp_path / "library.cpp"
    unit.write_text(one_unit())
    compiled(["g++", *LANGUAGE, *WARNINGS, *includes(), "-fsyntax-only", str(unit)])


def test_the_program_of_the_page_runs(tmp_path: Path) -> None:
    need_compilers()
    unit = page_program(tmp_path)
    assert len(unit.read_text().splitlines()) <= 50
    program = build("page", [unit], SANITIZED)
    printed = run(program, [str(next(path for path in PACKS if path.stem == "joints"))])
    assert "4 expressions, 5 joints, 2 clips" in printed
    assert "dispatch blend: 1 groups" in printed
    assert subprocess.run([str(program), str(unit)], capture_output=True, check=False).returncode == 1


@pytest.mark.hypothesis
def test_libfuzzer_finds_nothing() -> None:
    need_compilers()
    try_once(PACKS)
    said = fuzz(round(SECONDS * FACTOR) or SECONDS, -1, tiny(), seed=17 if not FACTOR else 0)
    print(f"{executions(said)} inputs")
    assert executions(said) > 50


@pytest.mark.more
def test_two_threads_pose_two_avatars(tmp_path: Path) -> None:
    need_compilers()
    unit, program = tmp_path / "library.cpp", tmp_path / "threads"
    unit.write_text(one_unit())
    own = [
        str(NATIVE / "tests" / "threads.cpp"),
        *includes(),
        "-fsanitize=thread",
        "-O1",
        "-g1",
    ]
    compiled(["clang++", *LANGUAGE, *WARNINGS, *own, str(unit), "-lpthread", "-o", str(program)])
    printed = run(program, [str(next(path for path in PACKS if path.stem == "joints"))])
    assert re.fullmatch(r"\d\d+ floats, equal\n", printed)


@pytest.mark.more
@pytest.mark.parametrize("target", TARGETS)
def test_the_library_compiles_for(target: str, tmp_path: Path) -> None:
    pytest.importorskip("ziglang")
    unit = tmp_path / "library.cpp"
    unit.write_text(one_unit())
    zig = [sys.executable, "-m", "ziglang", "c++", "-target", target]
    compiled(
        [*zig, *LANGUAGE, *WARNINGS, *includes(), "-O1", "-c", str(unit), "-o", str(tmp_path / "library.o")]
    )
