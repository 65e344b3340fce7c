"""Forty rows over two full-size checkpoints on workers limited to 3 GB: none of them may die for want of memory.

python -m bench.batch.memory FOLDER [--rows 40] [--gaussians 70000]

FOLDER keeps the checkpoints, 4.3 GB; bundles are removed as soon as a row is done.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import time
from pathlib import Path

from avatar_export.batch import cluster, row, running
from avatar_export.batch.job import Job
from avatar_export.batch.result import Result
from bench.batch.cpu import cpu_seconds
from bench.batch.faults import Row

FORMS = ("dump", "raw")
LIMIT_BYTES = 3_000_000_000
OPTIONS = {"preview": False, "reference": False, "engine_files": False}


class Tidy(running.Unheard):
    """Removes what a row wrote."""

    def ended(self, result: Result) -> None:
        """Keeps the disk empty."""
        shutil.rmtree(result.output, ignore_errors=True)


def source(folder: Path, form: str, gaussians: int) -> Path:
    """A full-size checkpoint, which is made if it is not there."""
    base = folder / f"{form}-{gaussians}" / "gaussian_blendshapes"
    if not (base / "driving.json").exists():
        flags = ("--system", "gaussian_blendshapes", "--gaussians", str(gaussians), "--form", form)
        subprocess.run([sys.executable, "-m", "samples.make", str(base.parent), *flags], check=True)
    return base


def memory_rows(folder: Path, rows: int = 40, gaussians: int = 70_000) -> list[Row]:
    """How many workers died, and how much memory rows took."""
    bases = [source(folder, form, gaussians) for form in FORMS]
    jobs = [
        Job(
            f"row_{index:02d}",
            str(bases[index % 2] / "model"),
            str(folder / "out" / f"row_{index:02d}"),
            {"dataset": str(bases[index % 2]), **OPTIONS},
        )
        for index in range(rows)
    ]
    before, cpu = time.perf_counter(), cpu_seconds()
    with cluster.local_client(2, memory_bytes=LIMIT_BYTES, preload=(row.__name__,)) as client:
        results = running.run(jobs, client, watch=Tidy())
    return [
        ("batch_memory_limit", LIMIT_BYTES / 1e6, "MB"),
        ("batch_memory_rows_done", sum(result.state == "done" for result in results), "1"),
        ("batch_memory_rows_begun_again", sum(result.attempts > 1 for result in results), "1"),
        ("batch_memory_largest_peak", max(result.peak_bytes for result in results) / 1e6, "MB"),
        ("batch_memory_wall", time.perf_counter() - before, "s"),
        ("batch_memory_cpu", cpu_seconds() - cpu, "s"),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--rows", type=int, default=40)
    parser.add_argument("--gaussians", type=int, default=70_000)
    for name, value, unit in memory_rows(**vars(parser.parse_args())):
        print(f"{name:36s} {value:12.4g} {unit}", flush=True)


if __name__ == "__main__":
    main()
