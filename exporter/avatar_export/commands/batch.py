"""`avatar-export batch`: many avatars, on this machine or on a Dask cluster, and what is shown while it runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from threading import Lock
from types import TracebackType
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TaskID, TextColumn, TimeElapsedColumn

from avatar_export.batch import expect_extra
from avatar_export.commands import arguments
from avatar_export.commands.console import Steps, messages, output
from avatar_runtime.io.errors import AvatarError, printable

if TYPE_CHECKING:
    from avatar_export.batch.result import Result

Rows = Annotated[
    str, typer.Argument(help="A .csv, a .jsonl, or a folder that is searched for avatars.", metavar="LIST")
]
Out = Annotated[str, typer.Option("--out", "-o", help="Folder or URL for the outputs and the report.")]
Workers = Annotated[
    int | None,
    typer.Option(help="Worker processes on this machine; default: one a core, as far as memory goes.", min=1),
]
Scheduler = Annotated[
    str | None, typer.Option(help="A Dask scheduler that runs already.", metavar="tcp://HOST:PORT")
]
Retries = Annotated[
    int, typer.Option(help="How often a row is tried again if it may go better.", min=0, max=100)
]
Resume = Annotated[bool, typer.Option("--resume", help="Do what an earlier batch left undone in OUT.")]
DryRun = Annotated[bool, typer.Option("--dry-run", help="Print rows, memory and expected time; do nothing.")]


def batch(
    rows: Rows,
    out: Out,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retries: Retries = 2,
    resume: Resume = False,
    dry_run: DryRun = False,
) -> None:
    """Convert many avatars, one row of LIST each, and write a report.

    Exit code 1 if a row failed.
    """
    expect_extra()
    from avatar_export.batch import jobs, report, running  # the libraries of the extra

    arguments.exclude({"--workers": workers, "--scheduler": scheduler})
    todo = jobs.read_list(rows, out)
    expect_shared(location for job in todo for location in (*job.inputs.values(), job.output))
    if dry_run:
        for line in report.plan(todo).splitlines():
            output.print(line)
        return
    expect_new(out, resume)
    with BatchProgress(len(todo)) as watch:
        results = running.run(
            todo, report_folder=out, workers=workers, scheduler=scheduler, retries=retries, watch=watch
        )
    finish(results, out)


def expect_shared(locations: Iterable[str]) -> None:
    """Raise AvatarError if one of the locations is in memory://, which each process has for itself."""
    from avatar_export.batch.locations import is_private

    for location in filter(is_private, locations):
        raise AvatarError(
            "no worker sees the memory of another process; name a folder or a store", file=location
        )


def expect_new(out: str, resume: bool) -> None:
    """Raise AvatarError if a batch wrote its report into the folder `out`, without `resume`."""
    from avatar_export.batch import report

    if not resume and report.exists(out):
        raise AvatarError(
            "holds the report of a batch; --resume does what is missing, or name another folder", file=out
        )


def finish(results: Sequence[Result], out: str) -> None:
    """Say how many rows are done; exit code 1 if one is not."""
    done = sum(result.ok for result in results)
    messages.print(f"{done} of {len(results)} rows are done; report: {out}/report.html")
    if done < len(results):
        raise typer.Exit(1)


class BatchProgress:
    """Shows the progress of `total` rows: on a terminal a line for all and one a worker; elsewhere a line a row,
    and one every few seconds (see `Steps`)."""

    def __init__(self, total: int, console: Console = messages) -> None:
        self._total, self._console = total, console
        self._bar = Progress(
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            TimeElapsedColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._steps = Steps(console)
        self._lines: dict[str, TaskID] = {}  # by worker
        self._at: dict[str, str] = {}  # row -> worker
        self._over: dict[str, bool] = {}  # row that ended -> whether it is done
        self._lock = Lock()
        self._all = self._bar.add_task("")

    def __enter__(self) -> BatchProgress:
        self._bar.start()
        if self._bar.disable:
            self._steps.__enter__()
        self._count()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()
        if self._bar.disable:
            self._steps.__exit__()
        if isinstance(error, KeyboardInterrupt | SystemExit):
            self.note(f"stopped: {self._counted()} came to their end; --resume does what is missing")

    def started(self, name: str, worker: str) -> None:
        """The line of the worker shows the row, with a new clock; that of a worker that lost the row goes away."""
        with self._lock:
            if name in self._over:
                return
            before = self._at.pop(name, worker)
            self._at[name] = worker
            self._show(worker)
            if before != worker:
                self._show(before, gone=True)

    def ended(self, result: Result) -> None:
        """Counts the row; failures stay on the terminal."""
        with self._lock:
            self._over[result.name] = result.ok
            worker = self._at.pop(result.name, None)
            if worker is not None:
                self._show(worker)
            if self._total == len(self._over) + len(self._at):  # no row is left that could begin
                for idle in self._lines.keys() - self._at.values():
                    self._show(idle, gone=True)
            self._count()
        if not result.ok:
            self.note(f"{result.name}: {result.state}: {result.message}; {result.remedy}")
        elif not self._console.is_terminal:
            self.note(
                f"{len(self._over)}/{self._total} {result.name}: {result.state}, {result.seconds:.1f} s"
            )

    def note(self, text: str) -> None:
        """Prints a line above the others."""
        self._console.print(text)

    def _show(self, worker: str, *, gone: bool = False) -> None:
        """Writes the line of a worker anew; `gone`: it has none if it does nothing."""
        rows = ", ".join(name for name, at in self._at.items() if at == worker)
        text = printable(f"worker {worker}: {rows or 'waits'}")
        if gone and not rows:
            if worker in self._lines:
                self._bar.remove_task(self._lines.pop(worker))
        elif worker in self._lines:
            self._bar.reset(self._lines[worker], description=text)
        else:
            self._lines[worker] = self._bar.add_task(text)

    def _count(self) -> None:
        self._steps.step(self._counted())
        self._bar.update(self._all, description=self._counted())

    def _counted(self) -> str:
        failed = list(self._over.values()).count(False)
        return f"{len(self._over)} of {self._total} rows{f', {failed} failed' if failed else ''}"
