"""What a batch costs against a shell loop of `convert`: CPU and wall time of the same rows.

python -m bench.batch.overhead FOLDER [--rows 300] [--loop 300]

The loop may be cut short: `--loop 60` runs it over the first 60 rows, which have the same avatars in turn, and the
figures of the batch are printed beside those of as many rows.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from avatar_export.batch.jobs import read_list
from bench.batch.command import Row, parsed, show
from bench.batch.lists import avatars_in, mostly_cheap, write_list

OPTIONS = {"dataset": "--dataset", "body_model": "--body-model", "rig": "--rig", "mesh": "--mesh"}
PLAIN = ("--no-preview", "--no-reference", "--no-engine-files")
PROGRAM = (sys.executable, "-m", "avatar_export")


def used(command: Sequence[str]) -> tuple[float, float]:
    """(wall, CPU) seconds of a command and of all that it starts."""
    before = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{shlex.join(command)[:200]} failed")
    return time.perf_counter() - before, usage.ru_utime + usage.ru_stime


def loop_of(path: Path, out: Path, rows: int) -> str:
    """A shell script that converts the first rows of a list one after the other."""
    lines = ["set -e"]
    for job in read_list(str(path), str(out))[:rows]:
        options = [text for name, text in OPTIONS.items() if name in job.options]
        values = [str(job.options[name]) for name in OPTIONS if name in job.options]
        given = [part for pair in zip(options, values, strict=True) for part in pair]
        shape = ["--shape", str(job.options["shape"])] if "shape" in job.options else []
        plain = ["convert", job.source, "-o", job.output, "--name", str(job.options["name"])]
        lines.append(shlex.join([*PROGRAM, *plain, *given, *shape, *PLAIN]))
    return "\n".join(lines)


def overhead_rows(folder: Path, rows: int = 300, loop: int = 300) -> list[Row]:
    """CPU and wall seconds of both."""
    made = avatars_in(folder)
    path = folder / "list.csv"
    write_list(path, mostly_cheap(made), rows)
    script = folder / "loop.sh"
    script.write_text(loop_of(path, folder / "by_loop", loop))
    wall, cpu = used(["sh", str(script)])
    batch = [*PROGRAM, "batch", str(path), "-o", str(folder / "by_batch"), "--workers", "2"]
    batch_wall, batch_cpu = used(batch)
    return [
        ("batch_rows", rows, "1"),
        ("batch_of_two_workers_wall", batch_wall, "s"),
        ("batch_of_two_workers_cpu", batch_cpu, "s"),
        ("loop_rows", loop, "1"),
        ("loop_of_convert_wall", wall, "s"),
        ("loop_of_convert_cpu", cpu, "s"),
        ("batch_wall_a_row", batch_wall / rows, "s"),
        ("loop_wall_a_row", wall / loop, "s"),
        ("batch_cpu_a_row", batch_cpu / rows, "s"),
        ("loop_cpu_a_row", cpu / loop, "s"),
    ]


if __name__ == "__main__":
    show(overhead_rows, parsed(__doc__, rows=300, loop=300))
