"""Workers of a kernel: each runs once, all have ended at the end, errors come through, and no thread is a must."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from avatar_runtime.backends.cpu import workers
from avatar_runtime.backends.cpu.workers import share


@pytest.mark.parametrize("count", [1, 2, 5])
def test_each_worker_runs_once_and_all_have_ended(count: int) -> None:
    ran: list[int] = []
    share(lambda worker, to: to.append(worker), count, ran)
    assert sorted(ran) == list(range(count))


@pytest.mark.parametrize("bad", [0, 2])
def test_an_error_comes_when_all_have_ended(bad: int) -> None:
    ran: list[int] = []

    def work(worker: int) -> None:
        if worker == bad:
            raise MemoryError(worker)
        ran.append(worker)

    with pytest.raises(MemoryError, match=str(bad)):
        share(work, 4)
    assert sorted(ran) == [worker for worker in range(4) if worker != bad]


def test_without_memory_for_a_thread_the_caller_does_all(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(_: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(workers, "_threads", workers._Threads())
    monkeypatch.setattr(threading.Thread, "start", none)
    ran: list[tuple[int, int]] = []
    share(lambda worker: ran.append((worker, threading.get_ident())), 3)
    assert sorted(ran) == [(worker, threading.get_ident()) for worker in range(3)]


def test_several_callers_share_the_threads() -> None:
    def total(start: int) -> int:
        parts: list[int] = []
        share(lambda worker, to: to.append(start + worker), 4, parts)
        return sum(parts)

    with ThreadPoolExecutor(8) as callers:
        assert list(callers.map(total, range(200))) == [4 * start + 6 for start in range(200)]
