"""Builds the native player for Windows: `python -m tools.windows.build`, into build/windows or another folder.

That is avatar_play.exe, avatar_player.dll with avatar_player.lib, by which a program links it, and the headers. Both
play on Direct3D 11 and need Microsoft's d3dcompiler_47.dll, which Windows 8.1 and later have.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

from avatar_shaders.tools import ShaderError
from tools.zig import LANGUAGE, ROOT, WARNINGS, BuildError, alone, compiled, written

TARGET = "x86_64-windows-gnu"
OUT = ROOT / "build/windows"
MADE = OUT / "made"
NATIVE = ROOT / "players/native"
LIBRARY = ("src/*/*.cpp", "scene/*.cpp", "d3d11/*.cpp")
HEADERS = (
    "include/avatar_player.h",
    "include/avatar_light.h",
    "include/avatar_conform.h",
    "d3d11/avatar_d3d11.h",
)
EXPORTED = "-DAVATAR_API=__attribute__((dllexport))"


def build(out: Path = OUT) -> list[Path]:
    """What a program needs, in a folder. Raises BuildError and ShaderError."""
    out = out.absolute()
    with alone(MADE):
        texts = MADE / "texts"
        script = NATIVE / "cmake/shader_texts.cmake"
        done = subprocess.run(["cmake", "-D", f"TO={texts}", "-P", script], capture_output=True, text=True)
        if done.returncode:
            raise BuildError(f"{done.stderr}the shader texts are not written: cmake refused")
        words = [*LANGUAGE, *WARNINGS, EXPORTED, f"-I{NATIVE / 'include'}", f"-I{texts}", "-static", "-s"]
        held = _unit("library", LIBRARY)
        out.mkdir(parents=True, exist_ok=True)
        library, program, linked = (
            out / f"avatar_{name}" for name in ("player.dll", "play.exe", "player.lib")
        )
        compiled(library, TARGET, [*words, "-shared", f"-Wl,--out-implib,{linked}", held])
        own = _unit("play", ("play/*.cpp",))
        compiled(
            program,
            TARGET,
            [*words, f"-Wl,--out-implib,{MADE / 'play.lib'}", held, own, "-ld3d11", "-lshell32"],
        )
    for header in HEADERS:
        shutil.copyfile(NATIVE / header, out / Path(header).name)
    return [program, library, linked, *(out / Path(header).name for header in HEADERS)]


def _unit(name: str, patterns: tuple[str, ...]) -> Path:
    """One file that includes all of them: it compiles faster."""
    files = [path for pattern in patterns for path in sorted(NATIVE.glob(pattern))]
    return written(
        MADE / f"{name}.cpp", "".join(f'#include "{path.as_posix()}"\n' for path in files).encode()
    )


def main() -> None:
    """Builds, and prints each file with its size."""
    parser = argparse.ArgumentParser(prog="python -m tools.windows.build", description=__doc__)
    parser.add_argument("--out", type=Path, default=OUT, help="folder for the files")
    try:
        for made in build(parser.parse_args().out):
            print(f"{made}  {made.stat().st_size:,} bytes")
    except (BuildError, ShaderError) as error:
        sys.exit(f"build: {error}")


if __name__ == "__main__":
    main()
