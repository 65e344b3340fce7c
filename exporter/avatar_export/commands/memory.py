"""How much memory this process may take, as far as the system says so, and what a program needs at least.

Libraries end the whole process where they get no memory while they start: NumPy's OpenBLAS, OpenUSD and LLVM with a
segmentation fault or an abort, which no program can catch. So the limits are read before anything is loaded.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

MIB = 1 << 20
PROC = Path("/proc")
CGROUPS = Path("/sys/fs/cgroup")
NO_LIMIT = 1 << 60  # bytes; version 1 of control groups says 2^63 less a page for none


@dataclass(frozen=True)
class Need:
    """What a command needs to load its libraries and to handle a small avatar; the table of SECURITY.md."""

    address_space: int  # bytes, without threads
    address_space_per_core: int  # bytes: stacks and buffers of each library's threads
    memory: int  # bytes in use


_USD = Need(1500 * MIB, 8 * MIB, 250 * MIB)
_NUMBA = Need(600 * MIB, 30 * MIB, 250 * MIB)
_TORCH = Need(950 * MIB, 8 * MIB, 350 * MIB)
# First argument of the command line -> need; "" for every other one.
EXPORT = {
    **dict.fromkeys(("convert", "validate", "batch"), _USD),
    **dict.fromkeys(("render", "pack", "conform", "view", "publish", "drop", "distill"), _NUMBA),
    "": Need(300 * MIB, 0, 100 * MIB),
}
TRAIN = {
    **dict.fromkeys(("check", "rules", "settings", "--help", "--version"), _TORCH),
    "": Need(1400 * MIB, 60 * MIB, 750 * MIB),
}


def need_of(needs: Mapping[str, Need], arguments: Sequence[str]) -> Need:
    """The need of a command line, without the program's name."""
    return needs.get(arguments[0] if arguments else "", needs[""])


def shortage(need: Need) -> str | None:
    """One line if less is free than needed; None if enough is, or if nobody says."""
    space = need.address_space + need.address_space_per_core * (os.cpu_count() or 1)
    for wanted, free in ((space, _address_space), (need.memory, _control_groups), (need.memory, _available)):
        for what, size, change in free():
            if size < wanted:
                return (
                    f"needs {wanted // MIB} MiB of {what}, but {max(size, 0) // MIB} MiB are free; {change}"
                )
    return None


Limits = Iterator[tuple[str, int, str]]  # (of what, bytes that are free, what to change)


def _address_space() -> Limits:
    """RLIMIT_AS less what is mapped; no row without a limit, and on Windows."""
    try:
        import resource
    except ImportError:
        return
    limit = resource.getrlimit(resource.RLIMIT_AS)[0]
    if limit != resource.RLIM_INFINITY:
        pages = _number(PROC / "self/statm") or 0
        yield "address space", limit - pages * resource.getpagesize(), "raise the limit (ulimit -v)"


def _control_groups() -> Limits:
    """The limit of each control group that holds this process, less what is used and cannot be dropped."""
    for folder, limit_file, used_file in _groups():
        limit = _number(folder / limit_file)
        if limit is not None and limit < NO_LIMIT:
            used = (_number(folder / used_file) or 0) - _cached(folder)
            yield "memory", limit - max(used, 0), "raise the memory limit of the container"


def _groups() -> Iterator[tuple[Path, str, str]]:
    for line in _text(PROC / "self/cgroup").splitlines():
        _, controllers, path = (*line.split(":", 2), "", "")[:3]
        if controllers == "":
            root, names = CGROUPS, ("memory.max", "memory.current")
        elif "memory" in controllers.split(","):
            root, names = CGROUPS / "memory", ("memory.limit_in_bytes", "memory.usage_in_bytes")
        else:
            continue
        own = root / path.lstrip("/")
        for folder in (own, *own.parents):
            if folder == root or root in folder.parents:
                yield folder, *names


def _cached(folder: Path) -> int:
    """Bytes of files in a group's memory, which the system drops when it needs room."""
    rows = (line.split() for line in _text(folder / "memory.stat").splitlines())
    return sum(int(row[1]) for row in rows if row[:1] in (["inactive_file"], ["active_file"]))


def _available() -> Limits:
    """What /proc/meminfo says is available, swap included."""
    rows = {line.partition(":")[0]: line.split() for line in _text(PROC / "meminfo").splitlines()}
    if "MemAvailable" in rows:
        kibibytes = sum(int(rows[name][1]) for name in ("MemAvailable", "SwapFree") if name in rows)
        yield "memory", kibibytes * 1024, "end other programs"


def _number(path: Path) -> int | None:
    """The first number in a file; None without a number ("max")."""
    words = _text(path).split()
    return int(words[0]) if words and words[0].isdigit() else None


def _text(path: Path) -> str:
    try:
        return path.read_text("ascii")
    except (OSError, ValueError):
        return ""
