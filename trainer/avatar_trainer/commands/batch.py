"""`avatar-train batch`: one training for each capture of a list, on this machine or on a Dask cluster."""

from __future__ import annotations

import fcntl
import io
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from avatar_export.batch import expect_extra
from avatar_export.commands import arguments, console, memory
from avatar_export.commands import batch as exporting
from avatar_runtime import AvatarError
from avatar_runtime.io import no_such
from avatar_trainer.commands.train import train_command
from avatar_trainer.loop import run
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.table import SYSTEMS

if TYPE_CHECKING:
    from avatar_export.batch import result

OWN = ("name", "source", "system", "output")  # columns besides the options of a training
SET_HERE = ("--out", "--resume", "--help")  # options that are not columns
BETWEEN = ";"  # several values of an option that may be repeated
LOCK = ".batch.lock"
LOG = "batch.log"
ON = ("true", "yes", "1")
MEGABYTE = 1_000_000

Rows = Annotated[
    str,
    typer.Argument(
        help="A .csv or .jsonl with the columns source, system, name, output, and options.", metavar="LIST"
    ),
]
Out = Annotated[Path, typer.Option("--out", "-o", help="Folder for the runs and the report.")]


@dataclass(frozen=True)
class Training:
    """One row: a command line of avatar-train."""

    name: str
    out: Path
    system: str
    words: tuple[str, ...]  # the capture, and options


def batch(
    rows: Rows,
    out: Out,
    workers: exporting.Workers = None,
    scheduler: exporting.Scheduler = None,
    retries: exporting.Retries = 2,
    resume: exporting.Resume = False,
    dry_run: exporting.DryRun = False,
) -> None:
    """Train an avatar for each row of LIST, and write a report. A run that was interrupted goes on from its newest
    checkpoint.

    Exit code 1 if a row failed.
    """
    expect_extra()
    from avatar_export.batch import engine, report, running  # the libraries of the extra
    from avatar_export.commands import batch as exporting

    arguments.exclude({"--workers": workers, "--scheduler": scheduler})
    trainings = read_list(rows, out.absolute(), max(1, (os.cpu_count() or 1) // workers) if workers else 1)
    needed = memory.TRAIN[""].memory + TrainSettings().cache_megabytes * MEGABYTE
    tasks = [engine.Task(one.name, needed, partial(do, one)) for one in trainings]
    if dry_run:
        for one in trainings:
            console.output.print(f"{one.name}: avatar-train {one.system} {' '.join(one.words)}")
        console.output.print(f"{len(tasks)} rows; memory of each up to {needed / 1e9:.1f} GB")
        return
    exporting.expect_new(str(out), resume)
    with exporting.BatchProgress(len(tasks)) as watch:
        client = running.opened(tasks, workers, scheduler, (__name__,))
        results = running.do(tasks, client, retries, watch, lambda found: report.write(found, str(out)))
    exporting.finish(results, str(out))


def read_list(location: str, out: Path, threads: int) -> list[Training]:
    """The rows of a list; runs lie below `out`, and take `threads` where a row does not say otherwise.

    Raises AvatarError with file and line for a wrong one.
    """
    from avatar_export.batch import jobs, locations

    location, out_name = jobs.placed(location, "LIST"), jobs.placed(str(out), "--out")
    columns = tuple(_options(next(iter(SYSTEMS))))  # every system has the same
    found: list[Training] = []
    captures: list[str] = []
    named: dict[int, str] = {}
    for line, row in jobs.read_rows(location, (*OWN, *columns)):
        where = {"file": location, "field": f"line {line}"}
        system = str(row.get("system", ""))
        if system not in SYSTEMS:
            raise no_such("system", system, SYSTEMS, **where)
        try:
            capture = locations.normal(
                locations.joined(locations.parent(location), str(row.get("source", "")))
            )
            name = str(row.get("name", locations.leaf(capture)))
            place = jobs.below(out_name, str(row.get("output", name)))
        except ValueError as error:
            raise AvatarError(str(error), **where) from None
        if not row.get("source") or locations.is_url(capture) or locations.is_url(place):
            raise AvatarError("a training needs a source and an output on a disk", **where)
        given = {"threads": threads, **{column: row[column] for column in columns if column in row}}
        words = (capture, "--out", place, *_words(given, system))
        try:
            _parser(system).make_context(system, list(words))
        except typer.BadParameter as error:
            raise AvatarError(error.format_message(), **where) from None
        named[len(found)] = f"{location}: line {line}"
        found.append(Training(name, Path(place), system, words))
        captures.append(capture)
    if not found:
        raise AvatarError("holds no row", file=location)
    rows = zip(found, captures, strict=True)
    jobs.refuse_shared([(one.name, str(one.out), {"source": capture}) for one, capture in rows], named)
    return found


@cache
def _parser(system: str) -> Any:
    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    app.command(system)(train_command(system))
    return typer.main.get_command(app)


def _options(system: str) -> dict[str, Any]:
    """Column -> option of a training: `sh_degree` for --sh-degree."""
    found = (option for option in _parser(system).params if option.param_type_name == "option")
    return {
        option.opts[0].lstrip("-").replace("-", "_"): option
        for option in found
        if option.opts[0] not in SET_HERE
    }


def _words(given: Mapping[str, object], system: str) -> Iterator[str]:
    for column, option in _options(system).items():
        if column not in given:
            continue
        flag, value = option.opts[0], str(given[column])
        if option.is_flag:
            yield from [flag] if value.lower() in ON else []
        else:
            for part in value.split(BETWEEN) if option.multiple else [value]:
                yield from (flag, part)


def do(one: Training, attempt: str) -> result.Result:
    """Trains in this process, from the newest checkpoint on if there is one. Raises for bugs only.

    What the command prints goes to OUT/batch.log. `attempt` is not needed: a run has one folder, and one attempt at a
    time.
    """
    from avatar_export.batch import failures, result
    from avatar_export.batch import meter as meters

    meter, said = meters.Meter(), io.StringIO()
    try:
        with _alone(one.out), redirect_stdout(said), redirect_stderr(said):
            _parser(one.system).main(list(one.words), one.system, standalone_mode=False)
        (one.out / LOG).write_text(said.getvalue(), "utf-8")
    except (AvatarError, OSError, MemoryError, typer.BadParameter) as error:
        kind = failures.kind_of(error)
        remedy = (
            "correct the row; `avatar-train` with it says the same"
            if kind == "input"
            else failures.KINDS[kind].remedy
        )
        message = " ".join((str(error) or "memory ran out").split())
        spent = meter.spent()
        return result.Result(
            one.name,
            "failed",
            kind,
            message,
            remedy,
            str(one.out),
            **spent,
            retryable=failures.KINDS[kind].retryable,
        )
    return result.Result(one.name, "done", output=str(one.out), **meter.spent(), psnr=_psnr_db(one.out))


@contextmanager
def _alone(out: Path) -> Iterator[None]:
    """Waits until no other process trains in the folder: an attempt goes on where the batch lost its connection."""
    out.mkdir(parents=True, exist_ok=True)
    with (out / LOCK).open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _psnr_db(out: Path) -> float | None:
    """Mean PSNR of the held-out frames, whole images; None without such frames."""
    means = json.loads((out / run.EVALUATION).read_text("utf-8"))["splits"].get("test", {})
    value = means.get("psnr_db")
    return None if value is None else float(value)
