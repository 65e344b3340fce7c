"""A batch from its first row to its report: the whole of `avatar-export batch` as one function."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import AbstractContextManager, closing, nullcontext
from functools import partial
from typing import Protocol

import distributed
from distributed import Client

from avatar_export.batch import cluster, engine, memory, outcomes, report, row, scratch, stores
from avatar_export.batch.job import Job
from avatar_export.batch.result import Result

UNDECLARED = (
    f"not every worker declares the resource {cluster.RESOURCE}: each does one row at a time, of any size"
)
NO_DASHBOARD = f"none; where the scheduler runs, `pip install {cluster.DASHBOARD}` gives one"
Report = Callable[[Sequence[Result]], None]


class Watch(Protocol):
    """Who hears how a batch goes on. `started` is called in another thread."""

    def started(self, name: str, worker: str) -> None:
        """The row `name` begins in `worker`."""

    def ended(self, result: Result) -> None:
        """A row came to its end."""

    def note(self, text: str) -> None:
        """A line about the cluster."""


class Unheard:
    """A Watch that does nothing."""

    def started(self, name: str, worker: str) -> None:
        """Nothing."""

    def ended(self, result: Result) -> None:
        """Nothing."""

    def note(self, text: str) -> None:
        """Nothing."""


def run(
    jobs: Sequence[Job],
    client: Client | None = None,
    *,
    report_folder: str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    retries: int = engine.RETRIES,
    watch: Watch | None = None,
) -> tuple[Result, ...]:
    """Does each row, and returns their results in the order of `jobs`. A row that is finished is kept as it is.

    - `client`: of a Dask cluster; by default that of the `scheduler` at an address, else of new `workers` on this
      machine (None: one a core, as far as memory goes).
    - `report_folder`: path or URL; report.jsonl and report.html are written there, also when the batch is stopped.
    - `retries`: how often a row that failed is tried again, if it may go better. Deaths of workers do not count.

    A row that fails never stops the others. Raises AvatarError for a cluster that cannot be reached, has no workers, or
    runs another version, and for a report that cannot be written; ValueError for two rows of one name.
    """
    tasks = [engine.Task(job.name, memory.expected(job)[0], partial(row.do, job)) for job in jobs]
    write: Report = (lambda results: None) if report_folder is None else partial(_report, report_folder)
    given = nullcontext(client) if client is not None else opened(tasks, workers, scheduler, (row.__name__,))
    try:
        return do(tasks, given, retries, watch or Unheard(), write)
    finally:
        with scratch.signals_wait():
            for job in jobs:
                stores.sweep(job.output)


def _report(folder: str, results: Sequence[Result]) -> None:
    report.write(results, folder)


def opened(
    tasks: Sequence[engine.Task], workers: int | None, scheduler: str | None, preload: Sequence[str]
) -> AbstractContextManager[Client]:
    """A client of the scheduler at an address, or of new workers on this machine that import `preload`."""
    if scheduler is not None:
        return cluster.scheduler_client(scheduler)
    largest = max((task.memory_bytes for task in tasks), default=0)
    return cluster.local_client(workers, largest_bytes=largest, preload=preload)


def do(
    tasks: Sequence[engine.Task],
    client: AbstractContextManager[Client],
    retries: int,
    watch: Watch,
    write: Report,
) -> tuple[Result, ...]:
    """Does the tasks on the client's cluster, once it is sound. `write` gets what there is: at first, and however the
    batch ends.
    """
    results = {task.name: outcomes.not_done(task.name) for task in tasks}
    if len(results) < len(tasks):
        raise ValueError("two rows have one name")
    with client as connected:
        workers = cluster.check(connected)
        write(tuple(results.values()))
        try:
            with closing(_results(tasks, connected, workers, retries, watch)) as ended:
                for result in ended:
                    results[result.name] = result
                    watch.ended(result)
        finally:
            write(tuple(results.values()))
    return tuple(results.values())


def _results(
    tasks: Sequence[engine.Task], client: Client, found: cluster.Workers, retries: int, watch: Watch
) -> Generator[Result, None, None]:
    if not found.declared:
        watch.note(UNDECLARED)
    if found.other_dask:
        watch.note(
            f"not every process runs the same {cluster.DASK}: {found.other_dask} and {distributed.__version__}"
        )
    watch.note(f"dashboard: {found.dashboard or NO_DASHBOARD}")
    yield from engine.run(tasks, client, found, retries=retries, started=watch.started, note=watch.note)
