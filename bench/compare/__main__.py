"""This checkout against an earlier one: the same parts of the bench, in turns, on one machine.

    python -m bench.compare [--against REVISION] [--only PART ...] [--rounds 3]

REVISION is the last release where none is named; it is checked out into a temporary folder. Each round runs every part
of both, each with its own `python -m bench`. Of a time, a size or a rate the best round counts: what else the
machine does makes rounds worse, never better. Rows that only one of the two has are counted and not judged.

Exit code 1 if a row of this checkout is worse by more than a tenth, which is named; 2 if nothing was compared. Wall
times are judged, too: on a machine that does other work, take more rounds, or believe the rows that end in `_cpu`.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

from avatar_export.commands.process import ending_by_signals
from bench.__main__ import PARTS

ROOT = Path(__file__).parents[2]
ALLOWED = 0.1  # of the earlier value
BEST = {
    "s": min,
    "ms": min,
    "us": min,
    "MB": min,
    "kB": min,
    "mm": min,
    "dB": max,
    "frames/s": max,
}  # by unit
IMPORTED = ("", "schema", "engine_shaders", "runtime", "exporter", "trainer")  # folders of a checkout
Values = dict[str, tuple[float, str]]  # row -> best value, unit


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--against", metavar="REVISION", help="default: the newest tag")
    parser.add_argument(
        "--only", nargs="+", choices=PARTS, default=[*PARTS], metavar="PART", help=", ".join(PARTS)
    )
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--gaussians", type=int, default=70_000)
    args = parser.parse_args()
    revision = args.against or newest_tag(ROOT)
    if revision is None:
        stop("no release is tagged here; name what to compare with: --against REVISION")
    with (
        ending_by_signals("bench.compare"),
        checked_out(ROOT, revision) as earlier,
        tempfile.TemporaryDirectory() as scratch,
    ):
        sides: dict[Path, dict[str, list[tuple[float, str]]]] = {earlier: {}, ROOT: {}}
        for _ in range(args.rounds):
            for part in args.only:
                for number, (checkout, found) in enumerate(sides.items()):
                    folder = Path(scratch, str(number))
                    for name, value, unit in part_rows(checkout, part, folder, args.gaussians):
                        found.setdefault(name, []).append((value, unit))
    before, now = (best(found) for found in sides.values())
    lines, fell = report(before, now)
    print("\n".join(lines))
    sys.exit(1 if fell else 0)


def stop(text: str) -> NoReturn:
    """Says why nothing was compared: exit code 2."""
    print(text, file=sys.stderr)
    sys.exit(2)


def newest_tag(repository: Path) -> str | None:
    """The newest tag that this checkout descends from; None without one."""
    done = git(repository, "describe", "--tags", "--abbrev=0", check=False)
    return done.stdout.strip() or None


@contextmanager
def checked_out(repository: Path, revision: str) -> Iterator[Path]:
    """A checkout of `revision` in a temporary folder, which goes away with the block."""
    with tempfile.TemporaryDirectory() as folder:
        checkout = Path(folder, "checkout")
        done = git(repository, "worktree", "add", "--detach", str(checkout), revision, check=False)
        if done.returncode:
            stop(f"{revision} cannot be checked out: {done.stderr.strip().splitlines()[-1]}")
        try:
            yield checkout
        finally:
            git(repository, "worktree", "remove", "--force", str(checkout))


def git(repository: Path, *words: str, check: bool = True) -> subprocess.CompletedProcess[str]:
    """What git says."""
    return subprocess.run(["git", "-C", str(repository), *words], check=check, capture_output=True, text=True)


def part_rows(checkout: Path, part: str, folder: Path, gaussians: int) -> Iterator[tuple[str, float, str]]:
    """The rows that the bench of a checkout prints of a part; `folder` keeps its checkpoints between rounds."""
    folder.mkdir(exist_ok=True)
    words = ("--only", part, "--keep", str(folder), "--gaussians", str(gaussians))
    if checkout == ROOT:
        words = (*words, "--no-save")  # the other checkout is thrown away with what it appends
    path = ":".join(str(checkout / name) for name in IMPORTED)
    bench = "bench" if (checkout / "bench").is_dir() else "tests.bench"  # where older revisions have it
    done = subprocess.run(
        [sys.executable, "-m", bench, *words],
        cwd=checkout,
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        text=True,
        check=False,
    )
    if done.returncode:
        stop(f"the part {part} of {checkout} ended with exit code {done.returncode}")
    yield from rows_in(done.stdout)


def rows_in(printed: str) -> Iterator[tuple[str, float, str]]:
    """The rows among printed lines: a name, a number and a unit."""
    for line in printed.splitlines():
        words = line.split()
        if len(words) == 3 and words[2] in (*BEST, "1"):
            yield words[0], float(words[1]), words[2]


def best(found: Mapping[str, Sequence[tuple[float, str]]]) -> Values:
    """The best of the rounds of each row; rows without a better and a worse (unit 1) are left out."""
    judged = {name: rounds for name, rounds in found.items() if rounds[0][1] in BEST}
    return {name: (BEST[rounds[0][1]](v for v, _ in rounds), rounds[0][1]) for name, rounds in judged.items()}


def report(before: Values, now: Values) -> tuple[list[str], list[str]]:
    """(what to print, the rows that fell by more than a tenth, worst first)."""
    share = {name: worse(*before[name], now[name][0]) for name in before.keys() & now.keys()}
    fell = sorted((name for name in share if share[name] > ALLOWED), key=lambda name: (-share[name], name))
    lines = [
        f"{name}: {now[name][0]:.4g} {now[name][1]} where it was {before[name][0]:.4g}, {share[name]:.0%} worse"
        for name in fell
    ]
    alone = len(before.keys() ^ now.keys())
    said = f"{len(fell)} of {len(share)} rows fell by more than a tenth"
    return [*lines, f"{said}; in one checkout alone: {alone}"], fell


def worse(before: float, unit: str, now: float) -> float:
    """By which part of the earlier value the new one is worse; negative if it is better."""
    lost = now - before if BEST[unit] is min else before - now
    return lost / abs(before) if before else float(lost > 0)


if __name__ == "__main__":
    main()
