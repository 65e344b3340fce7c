"""Runs tasks on a Dask cluster, and yields the result of each as it comes.

What goes wrong, and what happens then:

- A task fails: its result says so. Where it may go better another time, it is tried again, up to `retries` times.
- A worker dies: Dask gives its task to another one, whatever `retries` is, until more workers than
  `distributed.scheduler.allowed-failures` have died of it.
- The connection to the scheduler is cut: Dask cancels all tasks of the client. A new one submits again what is
  unfinished.
- The caller stops: tasks are cancelled.

No more tasks are submitted than can run at once. Dask blames the death of a worker on every task that was assigned to
it, also on those that only waited there, and it assigns tasks with resources at once.
"""

from __future__ import annotations

import queue
import time
import uuid
from collections import defaultdict, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field, replace
from typing import Any

from distributed import Client, Future, KilledWorker

from avatar_export.batch import cluster, outcomes
from avatar_export.batch.result import Result
from avatar_export.batch.worker import attempt
from avatar_runtime.io.errors import AvatarError

RETRIES = 2
WATCH_S = 0.25  # seconds between looks at the connection and at the workers

UNMANNED_S = 600.0  # seconds without a worker after which nobody waits on


@dataclass(frozen=True)
class Task:
    """Something to do in a worker."""

    name: str  # of the row, unique
    memory_bytes: int  # that it takes at its peak
    call: Callable[[str], Result]  # can be pickled; gets a text that no other attempt has


@dataclass
class _Given:
    """A task that was submitted."""

    task: Task
    failures: int  # earlier results that were failures
    future: Future = field(repr=False)


def run(
    tasks: Iterable[Task],
    client: Client,
    workers: cluster.Workers,
    *,
    retries: int = RETRIES,
    started: Callable[[str, str], None] = lambda name, worker: None,
    note: Callable[[str], None] = lambda text: None,
) -> Generator[Result, None, None]:
    """The result of each task, in the order in which they end. An exception in a task becomes a failed result.

    - `workers`: as `cluster.check` found them. A task that none of them has memory for is not submitted.
    - `started` is called, in another thread, with the names of a task and of the worker where it begins; `note` with
      lines about the cluster.

    Raises AvatarError if the scheduler is gone for good. Whatever ends the iteration early cancels what is unfinished.
    """
    engine = _Engine(client, workers, retries, started, note)
    engine.listen()
    try:
        for task in tasks:
            if workers.largest_bytes is not None and task.memory_bytes > workers.largest_bytes:
                yield outcomes.too_large(task.name, task.memory_bytes, workers.largest_bytes)
            else:
                engine.waiting.append((task, 0))
        while engine.waiting or engine.given:
            yield from engine.turn()
    finally:
        engine.end()


class _Engine:
    """What is waiting, what is submitted, and what came back."""

    def __init__(
        self,
        client: Client,
        workers: cluster.Workers,
        retries: int,
        started: Callable[[str, str], None],
        note: Callable[[str], None],
    ) -> None:
        self.client, self.workers, self.retries = client, workers, retries
        self.address, self.security = client.scheduler.address, client.security
        self.clients = ExitStack()  # those that replace the given one
        self.started, self.note = started, note
        self.topic = f"avatar-batch-{uuid.uuid4().hex}"
        self.waiting: deque[tuple[Task, int]] = deque()
        self.given: dict[str, _Given] = {}  # by key
        self.ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self.began: defaultdict[str, set[str]] = defaultdict(set)  # name -> attempts
        self.names: dict[str, str] = {}  # key -> name, of every task ever submitted
        self.slots = workers.slots
        self.looked = time.monotonic()  # when the workers were looked at
        self.manned = self.looked  # when there were some

    def listen(self) -> None:
        """Hear from workers which task they begin."""
        self.client.subscribe_topic(self.topic, self._heard)

    def _heard(self, event: tuple[float, Any]) -> None:
        begun = event[1]
        name = self.names[begun["key"]]
        if begun["attempt"] in self.began[name]:
            return  # an earlier client heard of it, too
        self.began[name].add(begun["attempt"])
        if len(self.began[name]) > 1:
            self.note(f"{name} begins again, in worker {begun['by']}")
        self.started(name, begun["by"])

    def turn(self) -> Iterator[Result]:
        """Submit what there is room for, and yield the next result, if there is one soon."""
        if time.monotonic() - self.looked > WATCH_S:
            self._watch()
        while self.waiting and len(self.given) < max(1, self.slots):
            task, failures = self.waiting.popleft()
            self._submit(self._key(task), task, failures)
        try:
            future = self.ended.get(timeout=WATCH_S)
        except queue.Empty:
            return
        given = self.given.get(future.key)
        if given is None or given.future is not future:
            return  # of an earlier connection
        result = self._result(given)
        if result is None:
            self._again()
            return
        del self.given[future.key]
        future.release()
        if result.state == "failed" and result.retryable and given.failures < self.retries:
            self.waiting.append((given.task, given.failures + 1))
        else:
            yield replace(result, attempts=max(result.attempts, len(self.began[given.task.name])))

    def _key(self, task: Task) -> str:
        """A new key for Dask."""
        key = f"avatar-{uuid.uuid4().hex}"
        self.names[key] = task.name
        return key

    def _submit(self, key: str, task: Task, failures: int) -> None:
        declared = self.workers.declared
        future = self.client.submit(
            attempt,
            task.call,
            key,
            self.topic,
            not declared,
            key=key,
            pure=False,
            resources={cluster.RESOURCE: task.memory_bytes} if declared else None,
        )
        self.given[key] = _Given(task, failures, future)
        future.add_done_callback(self.ended.put)

    def _result(self, given: _Given) -> Result | None:
        """What a task that ended gave; None if it was cancelled with the connection."""
        try:
            result: Result = given.future.result()
        except KilledWorker as error:
            return outcomes.killed(given.task.name, error.allowed_failures + 1)
        except Exception as error:  # of the task, which may be anything
            return None if given.future.cancelled() else outcomes.broken(given.task.name, error)
        return result

    def _watch(self) -> None:
        """Look at the connection and at the workers."""
        self.looked = time.monotonic()
        if self.client.status != "running" or any(key not in self.client.futures for key in self.given):
            self._again()
            return
        with suppress(OSError):  # the connection is being cut: the next look sees it
            self.slots = cluster.slots(self.client, self.workers.declared)
        if self.slots:
            self.manned = self.looked
        elif self.looked - self.manned > UNMANNED_S:
            raise AvatarError(
                f"has had no worker for {UNMANNED_S / 60:.0f} minutes; start some, and --resume does what is missing",
                file=self.address,
            )

    def _again(self) -> None:
        """Connect anew, and submit again all that is unfinished.

        The old client would come back of itself, with its old name. But a scheduler that sees late that the old
        connection is gone then drops all that this name asked for, also the new.
        """
        self.note("the connection to the scheduler was cut")
        self.client = self.clients.enter_context(cluster.connected_again(self.address, self.security))
        self.note(f"connected to the scheduler again; {len(self.given)} rows are submitted again")
        self.listen()
        for key, given in list(self.given.items()):
            # Under its old key, a task that still runs in its worker goes on.
            self._submit(key, given.task, given.failures)

    def end(self) -> None:
        """Cancel what is unfinished."""
        if self.client.status == "running":
            self.client.cancel([given.future for given in self.given.values()])
            self.client.unsubscribe_topic(self.topic)
        self.given.clear()
        self.clients.close()
