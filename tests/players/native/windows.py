"""Programs of the native player for Windows: compiled here, and run with Wine on a display in memory."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import tools.windows.build
from tools.windows import wine
from tools.windows.compiler import compiler

from tests.players.native.x11 import screen
from tests.session.native import build
from tests.session.needed import need

TARGET = tools.windows.build.TARGET
LIMIT_S = 1800
cpu_seconds: list[float] = []  # of each run, with Wine's server and what it started


def windows_program(name: str, files: Sequence[Path]) -> Path:
    """A program that plays on Direct3D 11; Microsoft's compiler of shaders lies beside it. See `need`."""
    flags = ("-O2", "-DAVATAR_DESK_D3D11")
    return _with_compiler(build(name, files, flags, ["-ld3d11", "-static", "-s"], gles=True, target=TARGET))


@cache
def built() -> Path:
    """The folder of what `python -m tools.windows.build` makes."""
    return _with_compiler(tools.windows.build.build()[0]).parent


def _with_compiler(program: Path) -> Path:
    try:
        library = compiler()
    except wine.Missing as error:
        need({f"Microsoft's compiler of shaders ({error})": None})
    beside = program.with_name(library.name)
    if not beside.is_file():
        shutil.copyfile(library, beside)
    return program


def run_windows(
    program: Path, words: Sequence[str], overrides: str = wine.OVERRIDES
) -> subprocess.CompletedProcess[str]:
    """Runs it to its end."""
    with tempfile.TemporaryDirectory() as folder, screen(Path(folder)) as shown:
        environment = {"DISPLAY": shown.name, "WINEDLLOVERRIDES": overrides}
        try:
            said = wine.run([program, *words], environment, limit_s=LIMIT_S)
        except wine.Missing as error:
            need({f"Wine ({error})": None})
    cpu_seconds.append(said.cpu_s)
    return subprocess.CompletedProcess([str(program), *words], said.code, said.out, said.error)
