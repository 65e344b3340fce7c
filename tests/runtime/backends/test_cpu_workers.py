"""Workers of a kernel: an error comes when all have ended, and no thread is a must."""

from __future__ import annotations

import threading

import pytest

from avatar_runtime.backends.cpu import workers
from avatar_runtime.backends.cpu.workers import share


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
