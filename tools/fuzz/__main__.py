"""`python -m tools.fuzz`: hostile inputs in large numbers, and a table of what became of them."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
import warnings
from pathlib import Path

from tools.fuzz.attack import CORPUS
from tools.fuzz.run import Tally, run
from tools.fuzz.targets import TARGETS

INPUTS = 1_000_000


def main() -> None:
    """Print the figures; the exit code is 1 after a finding."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--inputs", type=int, default=INPUTS, help="over all targets")
    parser.add_argument("--seconds", type=float, help="stop after that long")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="number of the first input")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--target", choices=TARGETS, action="append", help="these alone; may be repeated")
    given = parser.parse_args()
    names = given.target or list(TARGETS)
    counts = {name: given.inputs // len(names) for name in names}
    warnings.simplefilter("error")  # of NumPy: a user would see them
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="avatar-fuzz-", dir=_memory()) as folder:
        limits = {name: getattr(given, name) for name in ("seed", "first", "workers", "seconds")}
        found = run(counts, Path(folder), **limits)
    print(table(found, time.monotonic() - began))
    total = sum(tally.findings for tally in found.values())
    if total:
        print(f"findings are in {CORPUS}; each needs a fix, and stays there")
    sys.exit(1 if total else 0)


def table(found: dict[str, Tally], seconds: float) -> str:
    """A row a target, and one for all."""
    whole = Tally()
    for tally in found.values():
        whole.add(tally)
    lines = [
        "| target | inputs | sound | refused in one line | crashes | hangs | over the memory limit | most memory, MiB "
        "| ms of CPU each |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name, t in [*found.items(), ("**all**", whole)]:
        each = 1000 * t.cpu_seconds / max(t.inputs, 1)
        ended = f"{t.inputs} | {t.sound} | {t.refused} | {t.crashes} | {t.hangs} | {t.greedy}"
        lines.append(f"| {name} | {ended} | {t.most_memory >> 20} | {each:.1f} |")
    return "\n".join([*lines, "", f"{whole.inputs} inputs in {seconds:.0f} s"])


def _memory() -> str | None:
    """A folder in memory where the system has one: a million small files wear no disk."""
    return "/dev/shm" if Path("/dev/shm").is_dir() else None


if __name__ == "__main__":
    main()
