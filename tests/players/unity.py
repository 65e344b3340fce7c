"""Compiles parts of the Unity player with their tests and runs them under mono, without Unity."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest

from tests.session.needed import need
from tests.session.shared_folder import made_once

UNITY = Path(__file__).parents[2] / "players" / "unity"
STUBS = Path(__file__).parent / "unity_stubs"
PACKAGES = (
    "Universal",
    "HighDefinition",
    "ARFoundation",
)  # folders of the runtime: assemblies for other packages
LANGUAGE = "7.2"  # of C#, as each Unity from 2022.3 compiles it
LIMIT_S = 600


def need_mono() -> None:
    """The compiler and the runtime. See `need`."""
    need({"mcs (mono-mcs)": shutil.which("mcs"), "mono (mono-runtime)": shutil.which("mono")})


def sources(*folders: Path) -> list[Path]:
    """The C# files below the folders."""
    return [path for folder in folders for path in sorted(folder.rglob("*.cs"))]


def core_sources() -> list[Path]:
    """The files of the core."""
    return sources(UNITY / "Core")


def runtime_sources() -> list[Path]:
    """The files of the runtime without the parts that need packages of Unity."""
    return [path for path in sources(UNITY / "Runtime") if not {*PACKAGES} & {*path.parts}]


def compile_csharp(files: Iterable[Path], out: Path, *options: str) -> Path:
    """Compiles C# to `out`, a library or a program by its name. A warning fails the test, as an error does."""
    need_mono()
    target = "library" if out.suffix == ".dll" else "exe"
    flags = [
        f"-langversion:{LANGUAGE}",
        "-warn:4",
        "-warnaserror",
        "-nologo",
        f"-target:{target}",
        f"-out:{out}",
    ]
    command = ["mcs", *flags, *options, *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return out


def program_of_tests(
    factory: pytest.TempPathFactory, name: str, files: Callable[[Path], Iterable[Path]]
) -> Path:
    """A program that runs the tests in some files. It is compiled once for all workers."""
    need_mono()

    def make(folder: Path) -> Path:
        return compile_csharp([*files(folder), *sources(STUBS / "mono")], folder / "tests.exe")

    return made_once(factory, name, make)


def run_tests(program: Path, *fixtures: str, **environment: str) -> str:
    """What the tests of these classes print. Fails the test with what failed there, and where one was ignored."""
    done = subprocess.run(
        ["mono", str(program), *fixtures],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=LIMIT_S,
        check=False,
    )
    failed = [line for line in done.stdout.splitlines() if not line.startswith("ok ")]
    assert done.returncode == 0, "\n".join(failed)[:5000] + done.stderr[-2000:]
    assert " 0 ignored" in failed[-1], failed
    return done.stdout
