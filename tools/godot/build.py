"""Builds the binaries of the add-on: `python -m tools.godot.build [TARGET ...|all]`, by default for this machine.

Zig compiles for all six targets from here, and keeps what it compiled: again, after a change in one file, takes
seconds. The first build for a target also compiles the C++ library for it, which takes a minute or two.
"""

from __future__ import annotations

import argparse
import hashlib
import platform
import sys
from pathlib import Path

import avatar_shaders
from avatar_shaders.generate import HLSL
from avatar_shaders.godot import godot_shaders
from avatar_shaders.tools import ShaderError
from tools.zig import LANGUAGE, ROOT, WARNINGS, BuildError, alone, compiled, written

BIN = ROOT / "players/godot/bin"
WORK = ROOT / "build/godot"
SOURCES = ("players/native/src/*/*.cpp", "players/native/scene/*.cpp", "players/godot/extension/**/*.cpp")
TARGETS = {  # Zig's name of it; Linux: glibc of 2018, macOS: the oldest that Godot 4.6 supports on arm64
    "linux.x86_64": "x86_64-linux-gnu.2.28",
    "linux.arm64": "aarch64-linux-gnu.2.28",
    "windows.x86_64": "x86_64-windows-gnu",
    "windows.arm64": "aarch64-windows-gnu",
    "macos.x86_64": "x86_64-macos.11.0",
    "macos.arm64": "aarch64-macos.11.0",
}
MACHINES = {"aarch64": "arm64"}
HERE = f"{platform.system().lower()}.{MACHINES.get(platform.machine(), platform.machine())}"  # Linux: where it is run
SUFFIXES = {"linux": "so", "windows": "dll", "macos": "dylib"}
ENTRY = "gaussian_avatar_init"  # the one symbol that the engine sees


def file_name(target: str) -> str:
    """`libgaussian_avatar.linux.x86_64.so`."""
    return f"libgaussian_avatar.{target}.{SUFFIXES[target.partition('.')[0]]}"


def build(target: str, out: Path = BIN, hlsl: Path = HLSL) -> Path:
    """The library of a target, in the folder `out`, with the shaders of the folder `hlsl`.

    Raises BuildError and avatar_shaders.tools.ShaderError.
    """
    with alone(WORK):
        inside = WORK / target
        for folder in (inside, out):
            folder.mkdir(parents=True, exist_ok=True)
        written(WORK / "shaders/avatar_spirv.inc", _shaders(hlsl))
        made = inside / file_name(target)
        words = [*LANGUAGE, *WARNINGS, *_linked(target)]
        words += ["-DAVATAR_NO_SHADER_TEXTS", "-Iplayers/native/include", "-Ibuild/godot/shaders"]
        compiled(made.relative_to(ROOT), TARGETS[target], [*words, *_sources()])
        written(out / made.name, made.read_bytes())
        (out / made.name).touch()  # it is as new as its sources, also where it does not differ
    return out / made.name


def _linked(target: str) -> list[str]:
    """A library without names, that exports one function; for macOS, where Zig takes no list, also its allocator."""
    options = ["-shared", "-s", "-g0"]
    if target.startswith("linux"):
        written(WORK / "exports.map", f"{{ global: {ENTRY}; local: *; }};\n".encode())
        options += ["-fPIC", "-Wl,--version-script=build/godot/exports.map"]
    if target.startswith("macos"):
        options += [f"-Wl,-install_name,@rpath/{file_name(target)}"]
    return options


def _sources() -> list[str]:
    return [path.relative_to(ROOT).as_posix() for pattern in SOURCES for path in sorted(ROOT.glob(pattern))]


def _shaders(hlsl: Path) -> bytes:
    """avatar_spirv.inc of a folder of HLSL, kept by what it is made of."""
    makers = Path(avatar_shaders.__file__).parent.glob("*.py")
    read = [path.read_bytes() for path in (*sorted(hlsl.glob("*.hlsl*")), *sorted(makers))]
    kept = WORK / "spirv" / hashlib.sha256(b"\0".join(read)).hexdigest()
    if not kept.is_file():
        written(kept, godot_shaders(hlsl).encode())
    return kept.read_bytes()


def main() -> None:
    """Builds, and prints each file with its size."""
    parser = argparse.ArgumentParser(prog="python -m tools.godot.build", description=__doc__)
    parser.add_argument("targets", nargs="*", choices=[*TARGETS, "all", []], help=f"default: {HERE}")
    parser.add_argument(
        "--shaders", type=Path, default=HLSL, help="a folder of HLSL, in place of the one here"
    )
    parser.add_argument("--out", type=Path, default=BIN, help="folder for the files")
    asked = parser.parse_args()
    targets = list(TARGETS) if "all" in asked.targets else asked.targets or [HERE]
    try:
        for target in targets:
            made = build(target, asked.out, asked.shaders)
            print(f"{made}  {made.stat().st_size:,} bytes")
    except (BuildError, ShaderError) as error:
        sys.exit(f"build: {error}")


if __name__ == "__main__":
    main()
