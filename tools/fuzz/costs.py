"""`python -m tools.fuzz.costs`: what the worst packs of a size cost each reader, in seconds and MB above idle."""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from tests.players.hostile.judges import JUDGES
from tests.players.hostile.worst import WORST, worst

from tools.fuzz.readers import GOLDEN, Judge

SIZES = (16 << 10, 1 << 20, 16 << 20)


def cost(name: str, pack: bytes, small: bytes) -> tuple[float, float]:
    """(seconds, MB above idle) of one pack in a fresh reader that has read a small one. Linux alone says the memory."""
    with tempfile.TemporaryDirectory() as folder:
        judge = Judge(name, JUDGES[name](Path(folder)))
        judge.judge([small] * 3)
        before, began = judge.most_memory(), time.perf_counter()
        (said,) = judge.judge([pack])
        seconds, more = time.perf_counter() - began, judge.most_memory() - before
        judge.end()
    if said["ok"] == "crash":
        raise RuntimeError(f"{name}: {said['why']}")
    return seconds, more / 1e6


def main() -> None:
    """Print a row a pack and reader, and the worst of each reader."""
    parser = argparse.ArgumentParser(prog="python -m tools.fuzz.costs", description=__doc__)
    parser.add_argument("--size", type=int, action="append", help="bytes of a pack; may be repeated")
    parser.add_argument("--reader", choices=JUDGES, action="append", help="these alone; may be repeated")
    parser.add_argument("--kind", choices=WORST, action="append", help="these alone; may be repeated")
    given = parser.parse_args()
    small = (GOLDEN / "joints.avatar").read_bytes()
    for size in given.size or SIZES:
        most = dict.fromkeys(given.reader or JUDGES, (0.0, 0.0))
        for kind in given.kind or WORST:
            pack = worst(kind, small, size)
            for name in most:
                seconds, memory = cost(name, pack, small)
                row = f"{len(pack):>9} bytes, {kind:<22} {name:<7} {seconds:7.3f} s {memory:8.1f} MB"
                print(row, flush=True)
                most[name] = (max(most[name][0], seconds), max(most[name][1], memory))
        for name, (seconds, memory) in most.items():
            line = f"{size:>9} bytes, the worst: {name:<7} {seconds:.3f} s, {memory:.1f} MB above idle"
            print(line, flush=True)


if __name__ == "__main__":
    main()
