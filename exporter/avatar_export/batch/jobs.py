"""Lists of rows: CSV, JSON lines, or a folder that is walked for avatars."""

from __future__ import annotations

import csv
import io
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from avatar_export.batch import report, row_options, stores
from avatar_export.batch.job import STEPS, Job
from avatar_export.batch.locations import is_url, joined, leaf, normal, parent
from avatar_export.readers.table import detected
from avatar_runtime.io.errors import AvatarError, no_such

__all__ = ["Job", "read_list"]

LARGEST = 64 << 20  # bytes of a list
MOST_LOOKED_AT = 1_000_000  # files and folders of a walk
BETWEEN = re.compile(r"[\s,;]+")  # steps in one text
ELSEWHERE = re.compile(r"~|[A-Za-z]:|.*\\", re.DOTALL)  # home folders; drives and separators of Windows
AVATAR_NAME = "avatar_name"  # column of the option `name`: the column `name` is the row's
OPTIONS = {AVATAR_NAME if name == "name" else name: name for name in row_options.OPTIONS}  # by column
COLUMNS = ("name", "source", "output", "steps", *OPTIONS)
JSON_LINES = (".jsonl", ".ndjson")
Row = tuple[int, Mapping[str, Any]]  # line from 1, value by column


def read_list(location: str, out: str = ".") -> tuple[Job, ...]:
    """The rows of a .csv, a .jsonl, or a folder that is walked; outputs lie below the folder `out`.

    Sources and other files are seen from the folder of the list. A row without a name is called after its source; one
    without an output gets a folder of its name. Raises AvatarError with file, line and column for a list that cannot be
    read, an unknown column, a wrong value, for two rows with one name, or with outputs in one place or within each
    other, and for an output within an input of its row.
    """
    location, out = placed(location, "LIST"), placed(out, "--out")
    if not is_url(location) and os.path.isdir(location):
        if out == location:
            raise AvatarError("is the folder that is searched; name another", field="--out")
        jobs = _walked(Path(location), out)
        named = {index: f"{location}: {job.name}" for index, job in enumerate(jobs)}
    else:
        rows = list(read_rows(location))
        jobs = [_job(row, line, location, out) for line, row in rows]
        named = {index: f"{location}: line {line}" for index, (line, _) in enumerate(rows)}
    if not jobs:
        raise AvatarError("holds no row", file=location)
    refuse_shared([(job.name, job.output, job.inputs) for job in jobs], named)
    return tuple(jobs)


def placed(location: str, field: str) -> str:
    """`normal`, which raises AvatarError that names the argument `field`."""
    try:
        return normal(location)
    except ValueError as error:
        raise AvatarError(str(error), field=field) from None


def read_rows(location: str, columns: Sequence[str] = COLUMNS) -> Iterator[Row]:
    """(line, values by column) of a list; values of a CSV are texts, and empty ones are left out.

    Raises AvatarError for a list that cannot be read, and for a column that is not one of `columns`.
    """
    suffix = Path(leaf(location)).suffix.lower()
    if suffix != ".csv" and suffix not in JSON_LINES:
        if not is_url(location) and not os.path.exists(location):
            raise AvatarError("no such file or folder", file=location)
        raise AvatarError(
            f"is not a list; name a .csv, a {' or '.join(JSON_LINES)}, or a local folder to walk",
            file=location,
        )
    try:
        text = stores.read_bytes(location, LARGEST).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise AvatarError(f"is not UTF-8 (byte {error.start}); save it as UTF-8", file=location) from None
    yield from (_csv if suffix == ".csv" else _json_lines)(text, location, columns)


def _csv(text: str, location: str, known: Sequence[str]) -> Iterator[Row]:
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        columns = [column.strip() for column in next(reader, [])]
        _check_columns(columns, location, known)
        for cells in reader:
            if not any(cell.strip() for cell in cells):
                continue
            if len(cells) > len(columns):
                raise AvatarError(
                    f"has {len(cells)} cells, the first line {len(columns)}; quote cells that hold commas",
                    file=location,
                    field=f"line {reader.line_num}",
                )
            values = {column: cell.strip() for column, cell in zip(columns, cells, strict=False)}
            yield reader.line_num, {column: value for column, value in values.items() if value}
    except csv.Error as error:
        raise AvatarError(f"is not CSV ({error})", file=location, field=f"line {reader.line_num}") from None


def _check_columns(columns: Sequence[str], location: str, known: Sequence[str]) -> None:
    for between in (";", "\t"):
        if len(columns) == 1 and between in columns[0]:
            raise AvatarError(f"separates its columns by {between!r}; save it with commas", file=location)
    for column in columns:
        if column not in known:
            raise no_such("column", column, known, file=location, field="line 1")
        if columns.count(column) > 1:
            raise AvatarError(f"the column {column} stands there twice", file=location, field="line 1")
    if "source" not in columns:
        raise AvatarError("has no column source; the first line names the columns", file=location)


def _json_lines(text: str, location: str, known: Sequence[str]) -> Iterator[Row]:
    for number, line in enumerate(text.split("\n"), 1):
        if not line.strip():
            continue
        try:
            row = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise AvatarError(f"is not JSON ({error})", file=location, field=f"line {number}") from None
        if not isinstance(row, dict):
            raise AvatarError("is not a JSON object", file=location, field=f"line {number}")
        for column in row:
            if column not in known:
                raise no_such("column", column, known, file=location, field=f"line {number}")
        yield number, {column: value for column, value in row.items() if value is not None}


def _job(row: Mapping[str, Any], line: int, location: str, out: str) -> Job:
    """The row's job. Raises AvatarError that names the line and the column."""
    base = parent(location)

    def of(column: str, make: Callable[[], Any]) -> Any:
        try:
            return make()
        except (TypeError, ValueError) as error:
            raise AvatarError(str(error), file=location, field=f"line {line}, {column}") from None

    if not row.get("source"):
        raise AvatarError("names no source", file=location, field=f"line {line}, source")
    source = of("source", lambda: normal(joined(base, _text(row["source"]))))
    name = of("name", lambda: _text(row.get("name", leaf(source))))
    places = "output" if "output" in row else "name"
    output = of(places, lambda: below(out, _text(row.get("output", _without_ending(name)))))
    steps = of("steps", lambda: _steps(row.get("steps", ())))
    options = {
        OPTIONS[column]: of(column, partial(_value, OPTIONS[column], value, base))
        for column, value in row.items()
        if column in OPTIONS
    }
    job: Job = of("steps", lambda: Job(name, source, output, options, steps))
    return job


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r:.40} is not a text")
    return value


def below(out: str, output: str) -> str:
    """The normal location of a row's output, which lies below the folder `out` of the batch, also by its links.

    Raises ValueError for another one, and for what another system would place elsewhere.
    """
    outside = ValueError(
        "leads out of the folder of --out; name a folder below it, such as anna or heads/anna"
    )
    if ".." in output.split("/") or ELSEWHERE.match(output):
        raise outside
    location = normal(joined(out, output))
    if location == out:
        raise ValueError(f"{output[:80]!r} is the folder of the whole batch; name one in it")
    if not f"{_real(location)}/".startswith(f"{_real(out).rstrip('/')}/"):
        raise outside
    if location in (f"{out}/{report.JSON_LINES}", f"{out}/{report.PAGE}"):
        raise ValueError(f"{output[:80]!r} is the batch's own report; name another")
    return location


def _steps(value: Any) -> tuple[str, ...]:
    """Steps from a list, or from a text that separates them by spaces, commas or semicolons."""
    steps = BETWEEN.split(value.strip()) if isinstance(value, str) else value
    if not isinstance(steps, list | tuple) or not all(isinstance(step, str) for step in steps):
        raise TypeError(f"{value!r:.40} is not a list of steps")
    for step in filter(None, steps):
        if step not in STEPS:
            raise ValueError(no_such("step", step, STEPS).message)
    return tuple(filter(None, steps))


def _value(option: str, value: Any, base: str) -> Any:
    """The value of an option; a text is read as the option's kind."""
    if isinstance(value, str):
        value = row_options.read_text(option, value)
    return row_options.checked(option, value, base)


def _walked(folder: Path, out: str) -> list[Job]:
    """A row for each avatar below a folder, named by its path; what lies in an avatar's folder belongs to it.

    What nobody may read becomes a row that fails. The folder `out` is passed over: it holds the results of an earlier
    run.
    """
    jobs: list[Job] = []
    waiting, looked = [folder], 0
    while waiting:
        here = waiting.pop()
        try:
            entries = sorted(here.iterdir(), reverse=True)
        except OSError as error:
            raise AvatarError(f"cannot be read ({error.strerror or error})", file=here) from None
        looked += len(entries)
        if looked > MOST_LOOKED_AT:
            raise AvatarError(
                f"holds more than {MOST_LOOKED_AT:,} files; write a .csv of the rows", file=folder
            )
        for entry in entries:
            if str(entry) == out:
                continue
            if _is_row(entry):
                jobs.append(_found(entry, folder, out))
            elif entry.is_dir() and not entry.is_symlink():
                waiting.append(entry)
    return sorted(jobs, key=lambda job: job.name)


def _is_row(entry: Path) -> bool:
    """Whether an entry of a walk is an avatar, or could be one that cannot be read."""
    if os.access(entry, os.R_OK | (os.X_OK if entry.is_dir() else 0)):
        try:
            return detected(entry) is not None
        except AvatarError:  # of a file inside; the row says it
            return True
    return entry.is_dir() or entry.name.lower().endswith(stores.ALONE)


def _found(entry: Path, folder: Path, out: str) -> Job:
    """The row of an entry of a walk. Raises AvatarError for one whose path is no name of a row."""
    name = entry.relative_to(folder).as_posix()
    try:
        return Job(name, str(entry), below(out, _without_ending(name)))
    except ValueError as error:
        raise AvatarError(f"{error}; or write a .csv of the rows", file=entry) from None


def _without_ending(name: str) -> str:
    """The folder of a row that is called after a file: its path without `.zip` or `.avatar`."""
    while (ending := next(filter(name.lower().endswith, stores.ALONE), "")) and leaf(name).lower() != ending:
        name = name[: -len(ending)]
    return name


def refuse_shared(rows: Sequence[tuple[str, str, Mapping[str, str]]], named: Mapping[int, str]) -> None:
    """Raises AvatarError for rows (name, output, inputs by role) of one name, and for outputs that are one place or lie
    within each other or in an input. `named` says of each row where it stands.
    """
    names: dict[str, int] = {}
    outputs: dict[str, int] = {}
    for index, (name, output, inputs) in enumerate(rows):
        first = names.setdefault(name, index)
        if first != index:
            raise AvatarError(
                f"has the name {name[:80]!r} of {named[first]}; give each row a name of its own",
                file=named[index],
                field="name",
            )
        first = outputs.setdefault(_real(output), index)
        if first != index:
            raise AvatarError(
                f"has the output of {named[first]}, {output}; give each row an output of its own",
                file=named[index],
                field="output",
            )
        for role, location in inputs.items():
            if f"{_real(output)}/".startswith(f"{_real(location)}/"):
                raise AvatarError(
                    f"lies in the {role}, {location}, which would then never be the same again; name a place outside",
                    file=named[index],
                    field="output",
                )
    for place, index in outputs.items():
        above = place
        while (above := parent(above)) not in ("/", ""):
            if above in outputs:
                raise AvatarError(
                    f"lies in the output of {named[outputs[above]]}, {above}; list the rows with outputs of their own",
                    file=named[index],
                    field="output",
                )


def _real(location: str) -> str:
    """One spelling also where links lead to the place."""
    return location if is_url(location) else os.path.realpath(location)
