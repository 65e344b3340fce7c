"""What a batch says: its plan before, and after it report.jsonl and report.html."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from avatar_export.batch import memory, stores
from avatar_export.batch.job import Job
from avatar_export.batch.locations import normal
from avatar_export.batch.report_page import html_report
from avatar_export.batch.result import Result
from avatar_runtime.io.errors import AvatarError

JSON_LINES, PAGE = "report.jsonl", "report.html"
ADDRESS = re.compile(r"data:image/webp;base64,[A-Za-z0-9+/]{1,200000}={0,2}")


def plan(jobs: Sequence[Job]) -> str:
    """What a batch would do: a line a row, the largest memory, and the expected time."""
    rows = [(job, *memory.expected(job)) for job in jobs]
    width = max((len(job.name) for job in jobs), default=0)
    lines = [
        f"{job.name:<{width}}  {size / 1e9:5.2f} GB {seconds:6.0f} s  {job.source} -> {job.output}"
        f"{'  ' + ' '.join(job.steps) if job.steps else ''}"
        for job, size, seconds in rows
    ]
    largest = max((size for _, size, _ in rows), default=0)
    total = sum(seconds for _, _, seconds in rows)
    lines.append(
        f"{len(rows)} rows; memory of the largest {largest / 1e9:.2f} GB; expected CPU time {_duration(total)}, "
        "divided by the workers"
    )
    return "\n".join(lines)


def exists(folder: str) -> bool:
    """Whether a batch wrote its report into the folder. Raises AvatarError for a wrong location, and StoreError."""
    try:
        location = normal(folder)
    except ValueError as error:
        raise AvatarError(str(error), field="--out") from None
    return stores.exists(f"{location}/{JSON_LINES}")


def write(results: Sequence[Result], folder: str) -> None:
    """Writes report.jsonl, a line a result, and report.html into `folder`, in place of older ones.

    Raises AvatarError where they cannot be written."""
    folder = normal(folder)
    stores.make_folder(folder)
    lines = "".join(f"{json.dumps(result.as_json(), ensure_ascii=False)}\n" for result in results)
    stores.write_bytes(f"{folder}/{JSON_LINES}", lines.encode("utf-8", "backslashreplace"))
    page = html_report(results, {result.name: preview(result) for result in results if result.ok})
    stores.write_bytes(f"{folder}/{PAGE}", page.encode("utf-8", "backslashreplace"))


def preview(result: Result) -> str | None:
    """The small image of a row, which its worker made, as a data: address; None where it cannot be read."""
    try:
        record = stores.read_record(result.output)
    except AvatarError:  # the store fails; the row is done nevertheless
        return None
    address = None if record is None else record.get("preview")
    return address if isinstance(address, str) and ADDRESS.fullmatch(address) else None


def _duration(seconds: float) -> str:
    """`2 h 5 min`, `5 min`, `40 s`."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes // 60} h {minutes % 60} min" if minutes >= 60 else f"{minutes} min"
