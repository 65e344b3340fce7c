"""Tasks on two workers: what fails, what kills its worker, and what is lost with the connection."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest
from distributed import Client

from avatar_export.batch import cluster, engine
from avatar_export.batch.result import Result
from avatar_runtime.io.errors import AvatarError
from tests.exporter.batch.calls import ends, kills, raises, waits
from tests.exporter.batch.conftest import client_here

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
        "good": partial(ends, folder=tmp_path),
        "unlucky": partial(ends, state="failed", retryable=True, folder=tmp_path),
        "bad": partial(ends, state="failed", folder=tmp_path),
        "bug": partial(raises, folder=tmp_path),
    }
    found = done(client, tasks(calls), retries=2)
    tried = {"good": 1, "unlucky": 3, "bad": 1, "bug": 3}
    assert {name: result.attempts for name, result in found.items()} == tried
    assert {name: attempts(tmp_path, name) for name in calls} == tried
    assert [name for name, result in found.items() if result.state == "done"] == ["good"]
    assert found["bug"].kind == "bug" and found["bug"].message == "ZeroDivisionError: bug divides"
    large = done(client, tasks({"large": partial(ends, folder=tmp_path)}, 1 << 50))["large"]
    assert (large.state, large.kind, attempts(tmp_path, "large")) == ("failed", "memory", 0)


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


FAKE = "Metadata-Version: 2.1\nName: avatar-export\nVersion: 0.0.1\n"


@pytest.fixture(scope="module")
def bare() -> Iterator[Client]:
    """A client of two workers in this process: two threads each, nothing declared."""
    with client_here(2, threads_per_worker=2) as client:
        yield client


def refused(address: str) -> str:
    with pytest.raises(AvatarError) as caught, cluster.scheduler_client(address):
        pass
    return str(caught.value)


@pytest.mark.parametrize(
    "address",
    ["tcp://127.0.0.1", "127.0.0.1:8786", "http://127.0.0.1:1", "tcp://a:b", "tcp://anna:geheim@127.0.0.1:1"],
)
def test_an_address_is_a_scheme_a_host_and_a_port(address: str) -> None:
    said = refused(address)
    assert "is not tcp://HOST:PORT" in said and "geheim" not in said


@pytest.mark.parametrize("greeting", [b"", b"SSH-2.0-x\r\n", b"HTTP"])
def test_what_is_no_scheduler_is_one_line(greeting: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """A Client waits forever for the greeting of whatever listens there."""
    monkeypatch.setattr(cluster, "REACHED_S", 0.2)

    def greet(server: socket.socket) -> None:
        with server.accept()[0] as line, suppress(ConnectionResetError):
            line.sendall(greeting)
            line.recv(1)  # until the other side ends it

    with socket.create_server(("127.0.0.1", 0)) as server:
        other = threading.Thread(target=greet, args=(server,))
        other.start()
        said = refused(f"tcp://127.0.0.1:{server.getsockname()[1]}")
        other.join()
    assert "not a scheduler" in said


def test_without_a_worker_nothing_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "FIRST_WORKER_S", 0.1)
    with client_here(0) as client, pytest.raises(AvatarError, match="has no worker"):
        cluster.check(client)


def test_a_worker_of_another_version_is_named(bare: Client, tmp_path: Path) -> None:
    """A worker whose Python finds metadata of another version."""
    (tmp_path / "avatar_export-0.0.1.dist-info").mkdir()
    (tmp_path / "avatar_export-0.0.1.dist-info" / "METADATA").write_text(FAKE)
    command = [sys.executable, "-m", "distributed.cli.dask_worker", bare.scheduler.address, "--no-nanny"]
    worker = subprocess.Popen(
        [*command, "--no-dashboard", "--name", "older", "--nthreads", "1", "--host", "127.0.0.1"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)}, stderr=subprocess.DEVNULL, cwd=tmp_path,
    )  # fmt: skip
    try:
        bare.wait_for_workers(3, timeout=60)
        with pytest.raises(AvatarError, match=r"avatar-export 0\.0\.1"):
            cluster.check(bare)
    finally:
        worker.kill()
        worker.wait()
    assert cluster.check(bare).slots >= 2
