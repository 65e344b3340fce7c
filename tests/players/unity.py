"""Compiles the core of the Unity player with its tests and runs them under mono, without Unity."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.session.needed import need
from tests.session.shared_folder import made_once

UNITY = Path(__file__).parents[2] / "players" / "unity"
STUBS = Path(__file__).parent / "unity_stubs"
LANGUAGE = "7.2"  # of C#, as each Unity from 2022.3 compiles it
LIMIT_S = 600


def need_mono() -> None:
    """The compiler and the runtime. See `need`."""
    need({"mcs (mono-mcs)": shutil.which("mcs"), "mono (mono-runtime)": shutil.which("mono")})


def compile_csharp(sources: list[Path], out: Path, *options: str) -> None:
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
    command = ["mcs", *flags, *options, *map(str, sources)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]


def core_sources() -> list[Path]:
    """The files of the core."""
    return sorted((UNITY / "Core").rglob("*.cs"))


def core_tests(factory: pytest.TempPathFactory) -> Path:
    """The program of all tests of the core. It is compiled once for all workers."""
    need_mono()

    def make(folder: Path) -> Path:
        sources = [*core_sources(), *sorted((UNITY / "Tests" / "Core").rglob("*.cs"))]
        compile_csharp([*sources, *sorted((STUBS / "mono").glob("*.cs"))], folder / "tests.exe")
        return folder / "tests.exe"

    return made_once(factory, "unity_core_tests", make)


def run_core_tests(program: Path, *fixtures: str, **environment: str) -> str:
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
