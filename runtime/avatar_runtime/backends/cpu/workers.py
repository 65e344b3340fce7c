"""Threads of Python that run a kernel, each as one worker of several: kernels let other threads run.

Loops that Numba itself spreads took as long again to compile. An executor of the standard library would not do: where
memory has no room for a thread, it leaves the job in its queue, and nobody knows whether it runs.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any


class _Job:
    """One worker's call, its error, and a lock that is held until it has ended."""

    def __init__(self, work: Callable[..., None], worker: int, arguments: tuple[Any, ...]) -> None:
        self._call = (work, worker, arguments)
        self._running = threading.Lock()
        self._running.acquire()
        self._error: BaseException | None = None

    def run(self) -> None:
        work, worker, arguments = self._call
        try:
            work(worker, *arguments)
        except BaseException as error:
            self._error = error
        finally:
            self._running.release()

    def end(self) -> BaseException | None:
        """Waits until it has run; the error that it ended with."""
        self._running.acquire()
        return self._error


class _Threads:
    """The threads of this process. They start when first needed, and wait without using a core."""

    def __init__(self) -> None:
        self._jobs: SimpleQueue[_Job] = SimpleQueue()
        self._starting = threading.Lock()
        self._count = 0

    def take(self, jobs: list[_Job]) -> bool:
        """Runs the jobs, on as many threads as can be had; False if there is none at all."""
        with self._starting:
            while self._count < len(jobs) and self._start():
                self._count += 1
        if not self._count:
            return False
        for job in jobs:
            self._jobs.put(job)
        return True

    def _start(self) -> bool:
        try:
            threading.Thread(target=self._serve, name="avatar cpu", daemon=True).start()
        except RuntimeError:  # memory has no room for a thread
            return False
        return True

    def _serve(self) -> None:
        while True:
            self._jobs.get().run()


_threads = _Threads()


def _forked() -> None:
    global _threads
    _threads = _Threads()  # those of the parent process are not here


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forked)


def share(work: Callable[..., None], workers: int, *arguments: Any) -> None:
    """Calls `work(worker, *arguments)` for each worker below `workers`, each on a thread; one is the caller's.

    Ends when all have ended. Raises what one of them raised.
    """
    others = [_Job(work, worker, arguments) for worker in range(1, workers)]
    taken = not others or _threads.take(others)
    try:
        work(0, *arguments)
    finally:
        if not taken:
            for other in others:
                other.run()
        errors = [other.end() for other in others]
    for error in errors:
        if error is not None:
            raise error
