"""Clusters that are not as they should be: nobody there, no worker, another version, no memory declared."""

from __future__ import annotations

import io
import json
import logging
import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import nullcontext, suppress
from functools import partial
from pathlib import Path
from typing import ClassVar

import pytest
from distributed import Client, LocalCluster

from avatar_export.batch import cluster, engine, running
from avatar_export.batch.result import Result
from avatar_runtime.io.errors import AvatarError
from tests.exporter.batch.calls import together

FAKE = "Metadata-Version: 2.1\nName: avatar-export\nVersion: 0.0.1\n"
OLDER = """
from distributed import node, versions

now = versions.get_versions


def older(packages=None):
    found = now(packages)
    found["packages"]["distributed"] = "2025.1.0"
    return found


node.get_versions = versions.get_versions = older
from distributed.cli.dask_scheduler import main

main()
"""


@pytest.fixture(scope="module")
def bare() -> Iterator[Client]:
    """A client of two workers in this process: two threads each, nothing declared."""
    with (
        LocalCluster(
            n_workers=2, threads_per_worker=2, processes=False, dashboard_address="127.0.0.1:0", host="127.0.0.1",
            protocol="tcp",
        ) as made,
        Client(made, set_as_default=False) as client,
    ):  # fmt: skip
        yield client


@pytest.mark.parametrize(
    "address",
    ["tcp://127.0.0.1", "127.0.0.1:8786", "http://127.0.0.1:1", "tcp://a:b", "tcp://anna:geheim@127.0.0.1:1"],
)
def test_an_address_is_a_scheme_a_host_and_a_port(address: str) -> None:
    with (
        pytest.raises(AvatarError, match="is not tcp://HOST:PORT") as caught,
        cluster.scheduler_client(address),
    ):
        pass
    assert "geheim" not in str(caught.value)


def test_a_scheduler_that_nobody_reaches_is_one_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    with (
        pytest.raises(AvatarError, match=f"no scheduler answers at tcp://127.0.0.1:{port} .*refused"),
        cluster.scheduler_client(f"tcp://127.0.0.1:{port}"),
    ):
        pass


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
        port = server.getsockname()[1]
        with (
            pytest.raises(
                AvatarError, match=f"no scheduler answers at tcp://127.0.0.1:{port} .*not a scheduler"
            ),
            cluster.scheduler_client(f"tcp://127.0.0.1:{port}"),
        ):
            pass
        other.join()


def test_without_a_worker_nothing_begins(bare: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "FIRST_WORKER_S", 0.1)
    with (
        LocalCluster(
            n_workers=0, processes=False, dashboard_address="127.0.0.1:0", host="127.0.0.1", protocol="tcp"
        ) as made,
        Client(made, set_as_default=False) as client,
        pytest.raises(AvatarError, match="has no worker"),
    ):
        cluster.check(client)


def test_a_worker_of_another_version_is_named(bare: Client, tmp_path: Path) -> None:
    """A worker whose Python finds metadata of another version."""
    (tmp_path / "avatar_export-0.0.1.dist-info").mkdir()
    (tmp_path / "avatar_export-0.0.1.dist-info" / "METADATA").write_text(FAKE)
    command = [
        sys.executable,
        "-m",
        "distributed.cli.dask_worker",
        bare.scheduler.address,
        "--no-nanny",
        "--no-dashboard",
    ]
    worker = subprocess.Popen(
        [*command, "--name", "older", "--nthreads", "1", "--host", "127.0.0.1"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)}, stderr=subprocess.DEVNULL, cwd=tmp_path,
    )  # fmt: skip
    try:
        bare.wait_for_workers(3, timeout=60)
        with pytest.raises(
            AvatarError, match=r"runs avatar-export 0\.0\.1 on Python 3.*, but this is avatar-export"
        ):
            cluster.check(bare)
    finally:
        worker.kill()
        worker.wait()
    assert cluster.check(bare).slots >= 2


def test_a_scheduler_of_another_dask_is_one_line(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Dask prints a table, and goes on."""
    (tmp_path / "older.py").write_text(OLDER)
    file = tmp_path / "scheduler.json"
    command = [sys.executable, "older.py", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    scheduler = subprocess.Popen(
        [*command, "--scheduler-file", str(file)], stderr=subprocess.DEVNULL, cwd=tmp_path
    )
    try:
        while not (file.exists() and file.read_text().rstrip().endswith("}")):  # as a whole
            assert scheduler.poll() is None
            time.sleep(0.05)
        with cluster.scheduler_client(json.loads(file.read_text())["address"]) as client:
            found = cluster.look(client, client.get_versions(packages=[]))
    finally:
        scheduler.kill()
        scheduler.wait()
    assert (found.other_dask, found.slots) == ("2025.1.0", 0)
    assert capfd.readouterr().err == ""


def test_dask_logs_nothing_among_the_lines_of_a_batch(bare: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    """As it does with a traceback where a connection is cut."""
    shown = io.StringIO()
    monkeypatch.setattr(logging.getLogger("distributed"), "handlers", [logging.StreamHandler(shown)])
    with cluster.scheduler_client(bare.scheduler.address):
        logging.getLogger("distributed.batched").error("during")
    logging.getLogger("distributed.batched").error("after")
    assert "during" not in shown.getvalue() and "after" in shown.getvalue()


def test_where_no_memory_is_declared_a_worker_does_one_row_at_a_time(bare: Client, tmp_path: Path) -> None:
    class Heard(running.Unheard):
        lines: ClassVar[list[str]] = []

        def note(self, text: str) -> None:
            self.lines.append(text)

    tasks = [
        engine.Task(f"row{i}", 1 << 50, partial(together, f"row{i}", folder=tmp_path, seconds=0.1))
        for i in range(8)
    ]
    written: list[tuple[Result, ...]] = []
    results = running.do(tasks, nullcontext(bare), 0, Heard(), lambda r: written.append(tuple(r)))
    assert [r.name for r in results] == [task.name for task in tasks] and {r.state for r in results} == {
        "done"
    }
    assert {r.message for r in results} == {"0"}, "four threads in one process, but one row at a time"
    assert any("avatar_memory" in line for line in Heard.lines)
    assert {r.state for r in written[0]} == {"not done"} and written[-1] == results
