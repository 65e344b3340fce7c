"""Peak memory and CPU time of rows of a batch, each in a process of its own: the table of `batch.memory`.

python -m bench.batch.rows FOLDER [--only FORM]

FOLDER keeps the sample checkpoints, up to 6 GB.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from samples.make import make_gaussian_blendshapes, make_lam, make_splatting_head

from avatar_export.batch.job import STEPS, Job
from avatar_export.batch.memory import weight
from avatar_export.batch.row import do

Row = tuple[
    str, Callable[[Path], Path], dict[str, str]
]  # form; its maker; options by path in the made folder
FLAME = {"body_model": "body/body_model.npz", "poses": "flame_params.json"}


def sample(form: str, gaussians: int) -> tuple[Callable[[Path], Path], str, dict[str, str]]:
    """(maker, source in what it makes, options by path in it)."""
    if form in ("dump", "raw"):
        return lambda out: make_gaussian_blendshapes(out, gaussians, form=form), "model", {"dataset": "."}
    if form == "ply":
        return lambda out: make_splatting_head(out, gaussians), "run", FLAME
    return lambda out: make_lam(out), ".", {}


ROWS = (
    ("dump", 5_000),
    ("dump", 70_000),
    ("raw", 5_000),
    ("raw", 70_000),
    ("ply", 5_000),
    ("ply", 70_000),
    ("file", 0),
)


def job(folder: Path, form: str, gaussians: int, steps: bool) -> Job:
    """The row, whose sample is made if it is not there."""
    make, source, options = sample(form, gaussians)
    made = folder / f"{form}-{gaussians}"
    said = made / "made.json"
    if not said.exists():
        base = make(made)
        said.write_text(json.dumps(str(base)))
    base = Path(json.loads(said.read_text()))
    return Job(
        made.name,
        str(base / source),
        str(folder / "out" / f"{made.name}-{'all' if steps else 'none'}"),
        {name: str(base / path) for name, path in options.items()},
        STEPS if steps else (),
    )


def measured(folder: Path, form: str, gaussians: int, steps: bool) -> dict[str, Any]:
    """What the row took, in this process."""
    one = job(folder, form, gaussians, steps)
    shutil.rmtree(one.output, ignore_errors=True)
    result = do(one, "bench")
    if result.state != "done":
        sys.exit(f"{one.name}: {result.state} {result.message}")
    return {
        "form": weight(one)[0],
        "steps": steps,
        "read_bytes": weight(one)[1],
        "peak_bytes": result.peak_bytes,
        "cpu_seconds": round(result.cpu_seconds, 1),
    }


def measured_rows(folder: Path) -> Iterator[dict[str, Any]]:
    """`measured` of each of ROWS, without and with steps, in a fresh process each."""
    for form, gaussians in ROWS:
        for steps in (False, True):
            job(folder, form, gaussians, steps)  # made here: a child's peak begins anew
            only = (form, str(gaussians), "all" if steps else "none")
            command = [sys.executable, "-m", __spec__.name, str(folder), "--only", *only]
            found: dict[str, Any] = json.loads(
                subprocess.run(command, check=True, capture_output=True).stdout
            )
            yield found


def row_rows(folder: Path) -> Iterator[tuple[str, float, str]]:
    """The rows of `make bench`."""
    for found in measured_rows(folder):
        name = f"batch_row_{found['form']}_{found['read_bytes'] / 1e6:.0f}MB{'_all_steps' if found['steps'] else ''}"
        yield f"{name}_peak", found["peak_bytes"] / 1e6, "MB"
        yield f"{name}_cpu", found["cpu_seconds"], "s"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument(
        "--only", nargs=3, metavar=("FORM", "GAUSSIANS", "STEPS"), help="one row as JSON, in here"
    )
    given = parser.parse_args()
    folder = given.folder.absolute()
    if given.only:
        form, gaussians, steps = given.only
        print(json.dumps(measured(folder, form, int(gaussians), steps == "all")))
        return
    for found in measured_rows(folder):
        print(f"    Measured({', '.join(repr(value) for value in found.values())}),", flush=True)


if __name__ == "__main__":
    main()
