"""Tasks on two workers: what fails, what kills its worker, what is lost with the connection, and what is stopped."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path

from distributed import Client, LocalCluster

from avatar_export.batch import cluster, engine
from avatar_export.batch.result import Result
from tests.exporter.batch.calls import ends, kills, raises, waits

Call = Callable[[str], Result]


def tasks(calls: dict[str, Call], memory_bytes: int = 1000) -> list[engine.Task]:
    return [engine.Task(name, memory_bytes, partial(call, name)) for name, call in calls.items()]


def done(client: Client, given: list[engine.Task], retries: int = 0) -> dict[str, Result]:
    found = {}
    for result in engine.run(given, client, cluster.check(client), retries=retries):
        assert result.name not in found, "one result a task"
        found[result.name] = result
    return found


def attempts(folder: Path, name: str) -> int:
    return len(list(folder.glob(f"{name}-*")))


def test_failures_are_tried_again_where_that_may_help(client: Client, tmp_path: Path) -> None:
    calls: dict[str, Call] = {
        "good": partial(ends, state="done", retryable=False, folder=tmp_path),
        "unlucky": partial(ends, state="failed", retryable=True, folder=tmp_path),
        "bad": partial(ends, state="failed", retryable=False, folder=tmp_path),
        "bug": partial(raises, folder=tmp_path),
    }
    found = done(client, tasks(calls), retries=2)
    assert {name: (r.state, r.attempts) for name, r in found.items()} == {
        "good": ("done", 1), "unlucky": ("failed", 3), "bad": ("failed", 1), "bug": ("failed", 3)
    }  # fmt: skip
    assert {name: attempts(tmp_path, name) for name in calls} == {
        name: found[name].attempts for name in calls
    }
    assert found["bug"].kind == "bug" and found["bug"].message == "ZeroDivisionError: bug divides"


def test_what_no_worker_has_memory_for_is_not_submitted(client: Client, tmp_path: Path) -> None:
    calls: dict[str, Call] = {"large": partial(ends, state="done", retryable=False, folder=tmp_path)}
    found = done(client, tasks(calls, 1 << 50))
    assert (found["large"].state, found["large"].kind, attempts(tmp_path, "large")) == ("failed", "memory", 0)


def test_a_task_that_kills_its_workers_is_given_up_and_the_others_are_done(
    client: Client, tmp_path: Path
) -> None:
    calls: dict[str, Call] = {f"good{i}": partial(waits, seconds=0.05, folder=tmp_path) for i in range(6)}
    found = done(client, tasks({"killer": partial(kills, folder=tmp_path), **calls}))
    assert {r.state for name, r in found.items() if name in calls} == {"done"} and len(found) == 7
    assert (found["killer"].state, found["killer"].kind) == ("failed", "worker")
    assert attempts(tmp_path, "killer") == found["killer"].attempts == 2, "one death more than is allowed"


def test_a_connection_that_is_cut_loses_nothing(client: Client, tmp_path: Path) -> None:
    calls: dict[str, Call] = {f"task{i}": partial(waits, seconds=0.2, folder=tmp_path) for i in range(8)}
    with Client(client.scheduler.address, set_as_default=False) as other:

        async def cut() -> None:
            other.scheduler_comm.comm.abort()

        lines: list[str] = []
        found = []
        for result in engine.run(tasks(calls), other, cluster.check(other), note=lines.append):
            found.append(result)
            if len(found) == 2:
                other.sync(cut)  # and waits for it: six tasks are left
    assert sorted(r.name for r in found) == sorted(calls) and {r.state for r in found} == {"done"}
    assert any("was cut" in line for line in lines) and any("submitted again" in line for line in lines)


def test_a_row_of_a_worker_that_retires_is_done_by_another(tmp_path: Path) -> None:
    """As an adaptive cluster does it, or `retire_workers`: nothing died, but the worker goes."""
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=False, host="127.0.0.1", protocol="tcp",
            dashboard_address="127.0.0.1:0", resources={cluster.RESOURCE: 1000},
        ) as made,
        Client(made, set_as_default=False) as client,
    ):  # fmt: skip
        addresses = {
            str(info["name"]): address for address, info in client.scheduler_info()["workers"].items()
        }
        retired: list[str] = []

        def started(name: str, worker: str) -> None:
            if name == "row0" and not retired:
                retired.append(worker)
                threading.Thread(target=client.retire_workers, args=([addresses[worker]],)).start()

        calls: dict[str, Call] = {f"row{i}": partial(waits, seconds=0.5, folder=tmp_path) for i in range(4)}
        workers = cluster.check(client)
        found = list(engine.run(tasks(calls), client, workers, retries=0, started=started))
        assert len(client.nthreads()) == 1, "one has gone"
    assert sorted(r.name for r in found) == sorted(calls) and {r.state for r in found} == {"done"}
    assert attempts(tmp_path, "row0") <= 2 and all(attempts(tmp_path, f"row{i}") == 1 for i in (2, 3))


def test_stopping_cancels_what_is_unfinished(client: Client, tmp_path: Path) -> None:
    calls: dict[str, Call] = {f"task{i}": partial(waits, seconds=0.2, folder=tmp_path) for i in range(20)}
    with closing(engine.run(tasks(calls), client, cluster.check(client))) as results:
        next(results)
    begun = len(list(tmp_path.iterdir()))
    time.sleep(0.6)
    assert len(list(tmp_path.iterdir())) - begun <= 2, "only what ran already came to its end"
    assert not client.futures
