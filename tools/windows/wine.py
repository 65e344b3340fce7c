"""Runs programs for Windows with Wine, in a prefix of this checkout that nothing else uses.

The prefix lies in .cache/wine, or in the folder that AVATAR_WINE_DIR names. It is made once, in some 20 seconds; its
libraries are links to those of Wine, so that it takes 80 MB instead of 700. WINE names another Wine.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock

ROOT = Path(__file__).parents[2]
PLACES = (
    "/usr/lib/wine/wine64",
    "/usr/lib/wine/wine",
    "/opt/wine-stable/bin/wine64",
)  # Debian's is on no PATH
STAMP = "made"
LIMIT_S = 300
# Neither .NET nor a browser is offered for installation; Microsoft's compiler of shaders answers, or none does.
OVERRIDES = "mscoree,mshtml=;d3dcompiler_47=n"
REAPER = Path(__file__).with_name("reaper.py")


class Missing(Exception):
    """Why no program for Windows can be run, in one line."""


@dataclass(frozen=True)
class Said:
    """How a program ended."""

    code: int
    out: str
    error: str
    cpu_s: float  # of it, and of all that Wine started for it


def folder() -> Path:
    """Where the prefix lies, and what else is kept for Windows."""
    return Path(os.environ.get("AVATAR_WINE_DIR") or ROOT / ".cache" / "wine").absolute()


def program() -> str:
    """Wine for programs of 64 bits. Raises Missing."""
    named = os.environ.get("WINE")
    for place in (named,) if named else (*PLACES, "wine64", "wine"):
        found = shutil.which(place)
        if found:
            return found
    raise Missing(
        f"WINE={named} is no program" if named else "no Wine here; on Debian: apt-get install wine64"
    )


def server(wine: str) -> str:
    """The process that all programs of a prefix share."""
    for name in ("wineserver64", "wineserver"):
        found = shutil.which(name, path=str(Path(wine).parent)) or shutil.which(name)
        if found:
            return found
    raise Missing(f"{wine} has no wineserver beside it")


def prefix() -> Path:
    """The prefix, which is made where it is not there. Raises Missing."""
    wine, home = program(), folder()
    made = home / "prefix"
    if not (made / STAMP).exists():
        home.mkdir(parents=True, exist_ok=True)
        with FileLock(home / "prefix.lock"):
            if not (made / STAMP).exists():
                shutil.rmtree(made, ignore_errors=True)
                said = _start(wine, made, ["wineboot", "--init"], {}, None, LIMIT_S)
                if said.code or not (made / "system.reg").exists():
                    raise Missing(f"{wine} made no prefix in {made}: {' '.join(said.error.split())[-300:]}")
                _link_libraries(wine, made)
                (made / STAMP).touch()
    return made


def run(
    command: Sequence[str | Path],
    environment: Mapping[str, str] | None = None,
    cwd: Path | None = None,
    limit_s: float = LIMIT_S,
) -> Said:
    """Runs a program to its end, alone in the prefix. Paths of this system are understood, too. Raises Missing."""
    wine, made = program(), prefix()
    with FileLock(folder() / "prefix.lock"):
        return _start(wine, made, [str(word) for word in command], environment or {}, cwd, limit_s)


def windows_path(path: Path) -> str:
    """A path of this system as programs for Windows know it."""
    return "Z:" + str(path.absolute()).replace("/", "\\")


def _start(
    wine: str, made: Path, words: list[str], changed: Mapping[str, str], cwd: Path | None, limit_s: float
) -> Said:
    """Through the reaper, which waits until the last process has ended: what they cost is what children cost."""
    own = {"WINEPREFIX": str(made), "WINEARCH": "win64", "WINEDEBUG": "-all", "WINEDLLOVERRIDES": OVERRIDES}
    kept = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, "-IS", str(REAPER), str(limit_s), server(wine), wine, *words],
        env={**kept, "LC_ALL": "C.UTF-8", **own, **changed},
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Said(done.returncode, done.stdout.replace("\r\n", "\n"), done.stderr.replace("\r\n", "\n"), cpu_s)


def _link_libraries(wine: str, made: Path) -> None:
    """Puts links in place of the copies that a new prefix has of Wine's own libraries."""
    own = [path for path in Path(wine).resolve().parents[1].glob("**/x86_64-windows") if path.is_dir()]
    for library in (path for place in own for path in place.iterdir()):
        copy = made / "drive_c" / "windows" / "system32" / library.name
        if copy.is_file() and not copy.is_symlink() and copy.stat().st_size == library.stat().st_size:
            copy.unlink()
            copy.symlink_to(library)
