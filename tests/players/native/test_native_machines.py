"""On other machines the native core has the same layout, refuses with the same words, and stands what fuzzers found."""

from __future__ import annotations

import re
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tools.fuzz.mutate import places
from tools.fuzz.native import CORPUS, PACKS
from tools.fuzz.native_seeds import tiny, write_seeds
from tools.windows import wine
from tools.windows.build import build as build_library
from tools.zig import compiled

from tests.players.hostile.packs import Parts
from tests.players.native import ask, need_compilers, page_program, run
from tests.players.native.machines import ELSEWHERE, WINDOWS, Machine, parameters
from tests.session.native import LIMIT_S, NATIVE, build

LAYOUTS = (
    "x86_64-linux-gnu",
    "aarch64-linux-gnu",
    "x86_64-windows-msvc",
    "arm64-apple-macos",
    "aarch64-linux-android",
)
FOUND = CORPUS.parent / "pack"  # by other fuzzers
# Counts and offsets that 31, 32 and 53 bits do not hold.
FAR = (2**31 - 1, 2**31, 2**31 + 8, 2**32 - 1, 2**32, 2**32 + 8, 2**53, 2**63)


@pytest.fixture(params=parameters(*ELSEWHERE))
def other(request: pytest.FixtureRequest) -> Machine:
    """A machine that is not this one."""
    found: Machine = request.param
    found.need()
    return found


def test_structs_have_one_layout_on_machines_of_64_bits(tmp_path: Path) -> None:
    need_compilers()
    unit = tmp_path / "unit.c"
    unit.write_text('#include "avatar_conform.h"\n')
    options = ["-ffreestanding", "-nostdlibinc", f"-I{NATIVE / 'include'}", "-w", "-fsyntax-only"]
    found = []
    for target in LAYOUTS:
        command = [
            "clang",
            f"--target={target}",
            *options,
            "-Xclang",
            "-fdump-record-layouts-complete",
            str(unit),
        ]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
        assert done.returncode == 0, done.stderr
        records = done.stdout.split("*** Dumping AST Record Layout")
        found.append({text.strip() for text in records if "Avatar" in text})
    assert len(found[0]) >= 15 and all(one == found[0] for one in found)
    assert all(re.match(r"0 \| struct \w+\n +0 \|   uint32_t struct_size\n", text) for text in found[0])


def stream(files: list[bytes], path: Path) -> None:
    path.write_bytes(b"".join(struct.pack("<I", len(file)) + file for file in files))


def far_packs(file: bytes) -> Iterator[bytes]:
    """The pack with one whole number of its document, or of a tensor's place, so large that some integers overflow."""
    whole = Parts(file)
    count = len(list(_whole_numbers(whole)))
    for at in range(count):
        for value in FAR[at % 2 :: 2]:
            parts = Parts(file)
            holder, key = list(_whole_numbers(parts))[at]
            holder[key] = value
            yield parts.file()


def _whole_numbers(parts: Parts) -> list[tuple[Any, Any]]:
    tensors = {name: told for name, told in parts.header.items() if name != "__metadata__"}
    spots = [*places(parts.document), *list(places(tensors))[:60]]
    whole = [(holder, key) for holder, key in spots if type(holder[key]) is int]
    return whole[:: max(1, len(whole) // 60)]


def test_far_numbers_are_refused_in_the_same_words(other: Machine, unity_cases: Path, tmp_path: Path) -> None:
    files = [file for path in PACKS[::3] for file in far_packs(path.read_bytes())]
    hostile = [path.read_bytes() for path in sorted((unity_cases / "hostile").glob("*.avatar"))]
    stream([*files, *hostile], tmp_path / "files.bin")
    (here,), (there,) = ask("refusals", [tmp_path], tmp_path), ask("refusals", [tmp_path], tmp_path, other)
    differ = {key: (line, there[key]) for key, line in here.items() if line != there[key]}
    assert not differ and here.keys() == there.keys(), list(differ.values())[:5]
    refused = sum(line != b"" for line in here.values())
    print(f"{len(files)} packs with far numbers, {len(hostile)} hostile ones; {refused} refused, alike")
    assert refused > 700


def test_the_fuzzers_corpus_is_stood(other: Machine, tmp_path: Path) -> None:
    seeds = tmp_path / "seeds"
    seeds.mkdir()
    write_seeds(seeds, tiny())
    kept = [*sorted(CORPUS.glob("*")), *sorted(FOUND.glob("*/*.avatar"))]
    inputs = [path.read_bytes() for path in (*PACKS, *kept, *sorted(seeds.iterdir()))]
    stream(inputs, tmp_path / "inputs.bin")
    tests = [NATIVE / "tests" / f"{name}.cpp" for name in ("replay", *other.sources)]
    own = [*tests, *(NATIVE / "fuzz" / f"{name}.cpp" for name in ("fuzz_pack", "use_everything"))]
    program = build("_".join((*other.sources, "replay")), own, other.flags, target=other.target)
    assert run(program, [str(tmp_path / "inputs.bin")], other) == f"{len(inputs)} inputs\n"


@pytest.mark.players
def test_a_program_in_c_links_the_library_for_windows(tmp_path: Path) -> None:
    """The program of the page, with a name and a path that are longer than many programs for Windows stand."""
    Machine("windows", (), WINDOWS).need()
    made = build_library(tmp_path)
    unit = page_program(tmp_path)
    library = next(file for file in made if file.suffix == ".lib")
    program = compiled(tmp_path / "page.exe", WINDOWS, ["-O1", f"-I{tmp_path}", unit, library], "cc")
    deep = tmp_path / "a folder" / "/".join(["long" * 20] * 4)
    deep.mkdir(parents=True)
    pack = deep / "a head.avatar"
    pack.write_bytes(PACKS[0].read_bytes())
    said = wine.run([program, wine.windows_path(pack)])
    assert len(str(pack)) > 300 and said.code == 0 and "dispatch blend: 1 groups" in said.out, said
    said = wine.run([program, unit])
    assert said.code == 1 and re.fullmatch(r".*page\.c: is not a pack.*\n", said.error), said
