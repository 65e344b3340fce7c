"""What a row is expected to take: peak memory and CPU time, fitted from measured rows.

Memory is not proportional to the size of a checkpoint: the raw form of Gaussian Blendshapes holds the state of its
optimiser, which nobody reads. So each form has a line of its own, through its measured rows.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from avatar_export.batch import stores
from avatar_export.batch.job import Job
from avatar_export.batch.locations import leaf
from avatar_runtime.io.errors import AvatarError

MARGIN = 1.15  # of memory: rows of one size differ, and Dask itself takes some


@dataclass(frozen=True)
class Measured:
    """One row that was measured in a process of its own."""

    form: str  # one of FORMS
    steps: bool  # whether all of STEPS were done, or none
    read_bytes: int  # `weight` of its source
    peak_bytes: int
    cpu_seconds: float


# python -m bench.batch.rows FOLDER
MEASURED = (
    Measured("dump", False, 62561664, 279052288, 9.6),
    Measured("dump", True, 62561664, 520916992, 29.1),
    Measured("dump", False, 875841664, 861368320, 41.3),
    Measured("dump", True, 875841664, 1972895744, 99.6),
    Measured("raw", False, 180690071, 281554944, 14.2),
    Measured("raw", True, 180690071, 512753664, 30.1),
    Measured("raw", False, 2529529719, 859987968, 48.5),
    Measured("raw", True, 2529529719, 1972113408, 110.9),
    Measured("ply", False, 340414, 241074176, 20.2),
    Measured("ply", True, 340414, 452071424, 54.3),
    Measured("ply", False, 4760415, 281890816, 43.2),
    Measured("ply", True, 4760415, 527183872, 112.1),
    Measured("file", False, 4121447, 238346240, 17.2),
    Measured("file", True, 4121447, 532774912, 41.8),
)
FORMS = {  # form -> the files that make its size, by their path below the source; readers prefer the first
    "dump": re.compile(r"(.*/)?(\w+_t|shs|pos|rot|scale|opacity)\.npy"),
    "raw": re.compile(r".*\.pth"),
    "ply": re.compile(r".*\.ply"),
    "file": re.compile(r".*\.(zip|avatar|npz)"),
}


def weight(job: Job) -> tuple[str, int]:
    """(form, bytes that are read) of a row's source, by the names of its files; ("", 0) where nobody can look.

    A run holds many checkpoints, and one of them is read: the largest file counts, of a dump the largest folder.
    """
    try:
        files = stores.files_of(job.source)
    except AvatarError:  # the row itself will say so
        return "", 0
    sizes = {name or leaf(job.source): size for name, (size, _) in files.items()}
    for form, pattern in FORMS.items():
        fitting = {name: size for name, size in sizes.items() if pattern.fullmatch(name)}
        if fitting:
            return form, _largest(fitting, whole_folders=form == "dump")
    return "", 0


def _largest(sizes: Mapping[str, int], whole_folders: bool) -> int:
    if not whole_folders:
        return max(sizes.values())
    folders: dict[str, int] = {}
    for name, size in sizes.items():
        folder = posixpath.dirname(name)
        folders[folder] = folders.get(folder, 0) + size
    return max(folders.values())


def expected(job: Job) -> tuple[int, float]:
    """(peak memory, with a margin, CPU seconds on the machine of the measurement) that a row is expected to take."""
    form, size = weight(job)
    rows = _rows_like(form, job)
    peak = _on_line(rows, size, lambda row: row.peak_bytes)
    return round(MARGIN * peak), _on_line(rows, size, lambda row: row.cpu_seconds)


def _rows_like(form: str, job: Job) -> list[Measured]:
    """Measured rows of the form; of an unmeasured one all. A row with any step counts as one with all."""
    steps = bool(job.steps)
    found = [row for row in MEASURED if row.form == form and row.steps == steps]
    return found or [row for row in MEASURED if row.steps == steps]


def _on_line(rows: Sequence[Measured], size: int, of: Callable[[Measured], float]) -> float:
    """The value at `size` on the line through the least and the largest of the `rows`; never below the least one's."""
    low = min(rows, key=lambda row: row.read_bytes)
    high = max(rows, key=lambda row: row.read_bytes)
    if high.read_bytes == low.read_bytes:
        return of(high)
    slope = max(0.0, (of(high) - of(low)) / (high.read_bytes - low.read_bytes))
    return of(low) + slope * max(0, size - low.read_bytes)
