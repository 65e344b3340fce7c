"""Compiles the native player and programs of it; what is made is kept below out/ until a source changes."""

from __future__ import annotations

import hashlib
import subprocess
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache, partial
from pathlib import Path

from filelock import FileLock

from avatar_shaders.tools import program

NATIVE = Path(__file__).parents[2] / "players" / "native"
BUILT = Path(__file__).parents[2] / "out" / "native"  # programs by the hash of what they are made of
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Werror")
LANGUAGE = ("-std=c++17", "-fno-exceptions", "-fno-rtti", "-ffp-contract=off")
SANITIZED = ("-O1", "-g1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
# Edges are counted for libFuzzer. Comparisons are not traced, as -fsanitize=fuzzer would: that takes half of the time.
SANITIZED += ("-fsanitize-coverage=inline-8bit-counters,pc-table",)
LIMIT_S = 600
UNITS = {
    "data": ("src/formats", "src/made", "src/pack"),
    "work": ("src/c_interface", "src/conform", "src/drive", "src/play", "src/pose"),
    "gles": ("gles", "scene"),
    "d3d11": ("d3d11", "scene"),
}  # folders that are compiled together
WORKERS = 2


@cache
def shader_texts() -> Path:
    """The texts of the shaders for the sources, made as for any build without CMake."""
    BUILT.mkdir(parents=True, exist_ok=True)
    script = NATIVE / "cmake" / "shader_texts.cmake"
    with FileLock(BUILT / "shader_texts.lock"):
        _run(["cmake", "-D", f"TO={BUILT}", "-P", str(script)])
    return BUILT / "avatar_shader_texts.inc"


def includes() -> list[str]:
    """The folders in which the sources and programs find what they include."""
    return [f"-I{NATIVE / 'include'}", f"-I{shader_texts().parent}"]


def build(
    name: str,
    files: Sequence[Path],
    flags: Sequence[str],
    link: Sequence[str] = (),
    *,
    gles: bool = False,
    target: str = "",
) -> Path:
    """A program of the library and of C and C++ files, which is kept until one of them or the flags change.

    With `gles` it has the passes on OpenGL, too. With `target`, Zig's name of another machine, it is for that; on
    Windows the passes are those on Direct3D 11.
    """
    if target:
        flags, name = ("-target", target, *flags), f"{target}_{_short(flags)}_{name}"
    held = library(flags, gles)
    made = BUILT / f"{name}_{_digest(files, (*flags, *link, *(one.name for one in held)))}"
    made = made.with_suffix(".exe" if "windows" in target else "")
    with FileLock(BUILT / f"{name}.lock"):
        if not made.exists():
            _forget(f"{name}_*")
            objects = [made.with_name(f"{name}_{path.stem}.o") for path in files]
            pairs = zip(files, objects, strict=True)
            _side_by_side([partial(_compiled, path, flags, out) for path, out in pairs])
            _run([*_compiler(flags, "clang++"), *flags, *link, *map(str, [*objects, *held]), "-o", str(made)])
    return made


def library(flags: Sequence[str], gles: bool = False) -> list[Path]:
    """The library in a few objects, which are kept until a source or the flags change. A warning is an error."""
    player = "d3d11" if any("windows" in flag for flag in flags) else "gles"
    kinds = ["data", "work", *([player] if gles else [])]
    return _side_by_side([partial(_unit, kind, flags) for kind in kinds])


def _unit(kind: str, flags: Sequence[str]) -> Path:
    """The files of some folders in one object: they compile faster together."""
    files = _files(kind)
    name = f"{kind}_{_short(flags)}"
    made = BUILT / f"{name}_{_digest(files, flags)}.o"
    with FileLock(BUILT / f"{name}.lock"):
        if not made.exists():
            _forget(f"{name}_*.o")
            unit = BUILT / f"{name}.cpp"
            unit.write_text(_including(files))
            _compiled(unit, flags, made)
    return made


def _files(kind: str) -> list[Path]:
    return [path for folder in UNITS[kind] for path in sorted((NATIVE / folder).glob("*.cpp"))]


def _side_by_side(jobs: Sequence[Callable[[], Path]]) -> list[Path]:
    with ThreadPoolExecutor(WORKERS) as workers:
        return list(workers.map(lambda job: job(), jobs))


def _including(files: Sequence[Path]) -> str:
    return "".join(f'#include "{path}"\n' for path in files)


def one_unit() -> str:
    """The text of a file that includes all files: no name stands for two things."""
    return _including([path for kind in UNITS if kind != "d3d11" for path in _files(kind)])


def _digest(files: Sequence[Path], flags: Sequence[str]) -> str:
    found = hashlib.sha256(repr(tuple(flags)).encode())
    texts = sorted(shader_texts().parent.glob("avatar_*_texts.inc"))
    for path in [*files, *sorted(NATIVE.rglob("*.h")), *texts]:
        found.update(path.name.encode() + path.read_bytes())
    return found.hexdigest()[:16]


def _short(flags: Sequence[str]) -> str:
    return hashlib.sha256(repr(flags).encode()).hexdigest()[:6]


def _compiler(flags: Sequence[str], here: str) -> list[str]:
    return [program("zig"), "c++" if "++" in here else "cc"] if "-target" in flags else [here]


def _forget(pattern: str) -> None:
    for old in BUILT.glob(pattern):
        old.unlink()


def _compiled(path: Path, flags: Sequence[str], out: Path) -> Path:
    if path.suffix == ".c":
        language = [*_compiler(flags, "clang"), "-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
    else:
        language = [*_compiler(flags, "clang++"), *LANGUAGE, *WARNINGS]
    _run([*language, *flags, *includes(), "-c", str(path), "-o", str(out)])
    return out


def _run(command: Sequence[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 0, done.stderr[-5000:]
