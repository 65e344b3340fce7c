"""A batch whose workers are killed and whose connection is cut; afterwards every bundle is compared with `convert`'s.

python -m bench.batch.faults FOLDER [--rows 300] [--kills 5] [--cuts 1] [--sources URL] [--out URL]
    [--scheduler tcp://HOST:PORT]

The avatars, of all six systems, are made in FOLDER; --sources is a copy of them. --out is below FOLDER by default.
Without --scheduler two workers of this machine are started.
"""

from __future__ import annotations

import collections
import os
import random
import select
import signal
import socket
import threading
import time
from contextlib import ExitStack, closing, suppress
from pathlib import Path
from urllib.parse import urlsplit

from distributed import Client

from avatar_export.batch import cluster, report, row, row_options, running, stores
from avatar_export.batch.job import Job
from avatar_export.batch.jobs import read_list
from avatar_export.batch.result import Result
from avatar_export.conversion import convert
from bench.batch.command import Row, cpu_seconds, parsed, show
from bench.batch.lists import avatars_in, mostly_cheap, write_list

SEED = 19


class Cut:
    """Passes connections on to `address`, until they are cut."""

    def __init__(self, address: str) -> None:
        parts = urlsplit(address)
        self._there = (parts.hostname, parts.port)
        self._server = socket.create_server(("127.0.0.1", 0))
        self._open: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    @property
    def address(self) -> str:
        """Where it listens."""
        return f"tcp://127.0.0.1:{self._server.getsockname()[1]}"

    def cut(self) -> None:
        """Ends every connection that there is; new ones are passed on."""
        for one in self._open:
            with suppress(OSError):  # it had ended
                one.shutdown(socket.SHUT_RDWR)
        self._open.clear()

    def close(self) -> None:
        """Ends it."""
        self._server.close()

    def _accept(self) -> None:
        while True:
            try:
                near = self._server.accept()[0]
                far = socket.create_connection(self._there)
            except OSError:
                return
            self._open += [near, far]
            threading.Thread(target=self._pass, args=(near, far), daemon=True).start()

    def _pass(self, near: socket.socket, far: socket.socket) -> None:
        other = {near: far, far: near}
        with near, far:
            while True:
                try:
                    for ready in select.select([near, far], [], [])[0]:
                        data = ready.recv(1 << 16)
                        if not data:
                            return
                        other[ready].sendall(data)
                except (OSError, ValueError):
                    return


class Faults(running.Unheard):
    """Kills a worker, or cuts the connection, after as many results as chance says."""

    def __init__(self, client: Client, proxy: Cut, rows: int, kills: int, cuts: int) -> None:
        self._client, self._proxy, self._dice = client, proxy, random.Random(SEED)
        moments = self._dice.sample(range(1, max(rows - rows // 10, kills + cuts + 1)), kills + cuts)
        self._kills, self._cuts = set(moments[:kills]), set(moments[kills:])
        self._ended = 0
        self.killed = self.cut = 0

    def ended(self, result: Result) -> None:
        """Counts, and acts where it is time."""
        self._ended += 1
        if self._ended in self._kills:
            os.kill(self._dice.choice(sorted(self._client.run(os.getpid).values())), signal.SIGKILL)
            self.killed += 1
        if self._ended in self._cuts:
            self._proxy.cut()
            self.cut += 1


def with_faults(jobs: tuple[Job, ...], out: str, address: str | None, kills: int, cuts: int) -> list[Row]:
    """How it went."""
    cpu = cpu_seconds()
    with ExitStack() as stack:
        if address is None:
            own = stack.enter_context(cluster.local_client(2, preload=(row.__name__,)))
        else:
            own = stack.enter_context(cluster.scheduler_client(address))
        proxy = stack.enter_context(closing(Cut(own.scheduler.address)))
        client = stack.enter_context(cluster.scheduler_client(proxy.address))
        faults = Faults(own, proxy, len(jobs), kills, cuts)
        before = time.perf_counter()
        results = running.run(jobs, client, report_folder=out, watch=faults)
        seconds = time.perf_counter() - before
    states = collections.Counter(result.state for result in results)
    return [
        ("rows", len(results), "1"),
        ("workers_killed", faults.killed, "1"),
        ("connections_cut", faults.cut, "1"),
        *((state.replace(" ", "_"), count, "rows") for state, count in states.items()),
        ("tried_more_than_once", sum(result.attempts > 1 for result in results), "rows"),
        ("wall", seconds, "s"),
        *([("cpu", cpu_seconds() - cpu, "s")] if address is None else []),
    ]


def different(jobs: tuple[Job, ...], sources: tuple[Job, ...], work: Path) -> int:
    """Rows whose bundle is not, byte for byte, what `convert` writes of the local `sources`."""
    found = 0
    for job, local in zip(jobs, sources, strict=True):
        paths = {role: Path(location) for role, location in local.inputs.items()}
        expected = work / "converted" / job.name
        convert(local.source, expected, row_options.arguments(local.options, paths), force=True)
        found += contents(stores.bundle_of(job.output) or "") != contents(str(expected))
    return found


def contents(location: str) -> dict[str, str]:
    """SHA-256 of each file below a folder, local or in a store."""
    return {name: stores.sha256(location, name) for name in stores.files_of(location)}


def fault_rows(
    folder: Path,
    rows: int = 300,
    kills: int = 5,
    cuts: int = 1,
    sources: str | None = None,
    out: str | None = None,
    scheduler: str | None = None,
) -> list[Row]:
    """How a batch with faults went."""
    made = avatars_in(folder)
    local = folder / "list.csv"
    write_list(local, mostly_cheap(made), rows)
    out = out or str(folder / "out")
    near = read_list(str(local), str(folder / "unused"))
    if sources is not None:
        there = folder / "list_there.csv"
        there.write_text(local.read_text().replace(str(folder / "avatars"), sources))
        local = there
    far = read_list(str(local), out)
    found = with_faults(far, out, scheduler, kills, cuts)
    lines = stores.read_bytes(f"{out}/{report.JSON_LINES}", 1 << 30).count(b"\n")
    pages = stores.exists(f"{out}/{report.PAGE}")
    return [
        *((f"batch_{name}", value, unit) for name, value, unit in found),
        ("batch_lines_of_the_report", lines, "1"),
        ("batch_pages_of_the_report", pages, "1"),
        ("batch_bundles_unlike_convert", different(far, near, folder), "1"),
    ]


if __name__ == "__main__":
    show(fault_rows, parsed(__doc__, "sources", "out", "scheduler", rows=300, kills=5, cuts=1))
