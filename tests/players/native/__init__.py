"""Runs the probes of the native player."""

from __future__ import annotations

import os
import re
import shutil
import struct
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path

from tools.windows import wine

from tests.players.native.machines import HERE, Machine
from tests.session.native import LIMIT_S, NATIVE, build
from tests.session.needed import need


def need_compilers() -> None:
    """clang with its sanitizers, g++ and CMake. See `need`."""
    tools = {"clang++ (clang, libclang-rt-14-dev)": "clang++", "g++": "g++", "cmake": "cmake"}
    need({name: shutil.which(tool) for name, tool in tools.items()})


def probe(machine: Machine = HERE) -> Path:
    """The program of all probes, with sanitizers."""
    need_compilers()
    own = [NATIVE / "tests" / f"{name}.cpp" for name in ("probe", "checks", "refused", *machine.sources)]
    own.append(NATIVE / "fuzz" / "use_everything.cpp")
    return build("_".join((*machine.sources, "probe")), own, machine.flags, target=machine.target)


def ask(
    command: str, folders: Sequence[Path], out: Path, machine: Machine = HERE
) -> list[Mapping[str, bytes]]:
    """What a probe says of each folder. Fails the test where the program ends with an error, such as a sanitizer's."""
    files = [out / f"{command}_{at}.bin" for at in range(len(folders))]
    words = [
        word
        for folder, file in zip(folders, files, strict=True)
        for word in (command, str(folder), str(file))
    ]
    run(probe(machine), words, machine)
    return [records(file.read_bytes()) for file in files]


def run(program: Path, words: Sequence[str], machine: Machine = HERE) -> str:
    """What a program prints. It must end with 0."""
    if machine.on_windows:
        said = wine.run([program, *words])
        assert said.code == 0, f"{said.code}: {said.out[-2000:]}{said.error[-4000:]}"
        return said.out
    own = {**os.environ, "UBSAN_OPTIONS": "print_stacktrace=1", "ASAN_OPTIONS": "detect_leaks=1"}
    command = [*machine.emulator, str(program), *words]
    done = subprocess.run(command, env=own, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 0, f"{done.returncode}: {done.stdout[-2000:]}{done.stderr[-4000:]}"
    return done.stdout


def page_program(folder: Path) -> Path:
    """The program in C that the page shows, as a file."""
    programs = re.findall(r"```c\n(.*?)```", (NATIVE / "README.md").read_text(), re.DOTALL)
    (text,) = (program for program in programs if "int main" in program)
    (folder / "page.c").write_text(text)
    return folder / "page.c"


def records(data: bytes) -> dict[str, bytes]:
    """{name: bytes} of what class Records of tools.h writes."""
    found, at = {}, 0
    while at < len(data):
        (length,) = struct.unpack_from("<I", data, at)
        name = data[at + 4 : at + 4 + length].decode("utf-8", "surrogatepass")
        (size,) = struct.unpack_from("<Q", data, at + 4 + length)
        at += 12 + length
        found[name] = data[at : at + size]
        at += size
    return found
