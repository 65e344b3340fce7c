"""What `make bench` measures of batches: `python -m bench.batch.parts FOLDER [--rows 300] [--large 40]`."""

from __future__ import annotations

import argparse
from pathlib import Path

from bench.batch.faults import Row, fault_rows
from bench.batch.memory import memory_rows
from bench.batch.network import network_rows
from bench.batch.overhead import overhead_rows
from bench.batch.rows import row_rows


def batch_rows(folder: Path, rows: int = 300, large: int = 40, gaussians: int = 70_000) -> list[Row]:
    """Faults on one machine and over a network, the cost against a shell loop, memory, and rows alone.

    `rows` over small avatars, and `large` ones over checkpoints of as many `gaussians`.
    """
    return [
        *fault_rows(folder / "faults", rows),
        *network_rows(folder / "network", rows),
        *overhead_rows(folder / "overhead", rows, rows),
        *memory_rows(folder / "memory", large, gaussians),
        *row_rows(folder / "rows"),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rows", type=int, default=300)
    parser.add_argument("--large", type=int, default=40)
    parser.add_argument("--gaussians", type=int, default=70_000)
    for name, value, unit in batch_rows(**vars(parser.parse_args())):
        print(f"{name:40s} {value:12.4g} {unit}", flush=True)


if __name__ == "__main__":
    main()
