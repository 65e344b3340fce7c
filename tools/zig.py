"""Compiles C and C++ for other machines: Zig holds what each needs. What it compiled it keeps.

`python -m tools.zig` lets it compile its own libraries beforehand: minutes for which no test should wait.
"""

from __future__ import annotations

import fcntl
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from avatar_shaders.tools import program

ROOT = Path(__file__).parents[1]
# As players/native/CMakeLists.txt has them.
LANGUAGE = ("-std=c++17", "-O2", "-fno-exceptions", "-fno-rtti", "-ffp-contract=off", "-fvisibility=hidden")
WARNINGS = ("-Wall", "-Wextra", "-Wconversion", "-Wsign-conversion", "-Wshadow", "-Werror")

TESTED = {  # by `make test`: with other options Zig compiles its libraries again
    "x86_64-windows-gnu": ("-static", "-s"),
    "x86_64-linux-gnu.2.28": ("-shared", "-s", "-g0", "-fPIC"),
}


class BuildError(Exception):
    """What a compiler said."""


def compiled(made: Path, target: str, words: Sequence[str | Path], language: str = "c++") -> Path:
    """`made`, from options and sources, with paths from the root of the checkout. Raises BuildError and ShaderError."""
    command = [program("zig"), language, "-target", target, "-o", str(made), *map(str, words)]
    (ROOT / made).parent.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if done.returncode:
        raise BuildError(
            f"{done.stderr}{made.name} is not built: zig {language} ended with {done.returncode}"
        )
    return made


def written(path: Path, content: bytes) -> Path:
    """A file, whole, and touched only where it differs: a loaded library is replaced, not written over."""
    if not (path.is_file() and path.read_bytes() == content):
        path.parent.mkdir(parents=True, exist_ok=True)
        partial = path.with_name(f".{path.name}.partial")
        partial.write_bytes(content)
        partial.replace(path)
    return path


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """Two builds at once would write the same files."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def main() -> None:
    """Compiles nothing for each target of the tests."""
    with TemporaryDirectory() as folder:
        source = Path(folder, "nothing.cpp")
        source.write_text("#include <mutex>\nint main() { return 0; }\n")
        for target, options in TESTED.items():
            compiled(Path(folder, "nothing.exe"), target, [*LANGUAGE, *options, source])


if __name__ == "__main__":
    main()
