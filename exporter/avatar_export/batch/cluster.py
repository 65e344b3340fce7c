"""Dask clusters that a batch runs on: workers of this machine, or a scheduler that runs already.

A worker may declare the resource `avatar_memory`, in bytes: it then gets tasks that fit into it. What a scheduler or a
worker receives, it executes: workers of this machine listen on the loopback device alone.
"""

from __future__ import annotations

import logging
import re
import socket
import ssl
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

import dask
from dask.system import CPU_COUNT
from distributed import Client, LocalCluster
from distributed.security import Security
from distributed.system import MEMORY_LIMIT
from distributed.utils import silence_logging_cmgr
from distributed.versions import VersionMismatchWarning

from avatar_export.batch import scratch
from avatar_runtime.io.errors import AvatarError

SCHEDULER = re.compile(r"(tcp|tls)://[^/?#@\s]+/?", re.IGNORECASE)  # an address without anything secret
RESOURCE = "avatar_memory"
DISTRIBUTION = "avatar-export"
DASK = "distributed"
DASHBOARD = "bokeh"  # what Dask draws its dashboard with
QUIET = logging.CRITICAL  # what Dask logs from then on; a batch says itself that a connection was cut
LOOPBACK = "127.0.0.1"
REACHED_S = 10.0  # seconds within which a scheduler answers
GREETED = 8  # bytes that say how long a scheduler's greeting is
LONGEST_GREETING = 1 << 20  # bytes
PATIENCE_S = 120.0  # seconds within which a connection that was cut comes back
FIRST_WORKER_S = 60.0  # seconds within which a scheduler has a worker
SETTINGS = {
    "distributed.worker.profile.enabled": False,  # samples every thread a hundred times a second
    # A worker that is away this long after it died once is given up, even if it died again a moment ago.
    "distributed.deploy.lost-worker-timeout": "1 day",
}
MOST_NAMED = 3  # workers in a message


@dataclass(frozen=True)
class Workers:
    """What the workers of a cluster say of themselves."""

    slots: int  # tasks that can run at once: see `slots`
    declared: bool  # whether each declares RESOURCE
    largest_bytes: int | None  # largest RESOURCE of a worker; None: not declared
    dashboard: str | None  # address of the page that shows the work; None: the scheduler has none
    # The version of Dask that the scheduler or a worker runs, if it is not that of this process.
    other_dask: str | None


@contextmanager
def local_client(
    workers: int | None = None,
    *,
    largest_bytes: int = 0,
    memory_bytes: int | None = None,
    preload: Sequence[str] = (),
) -> Iterator[Client]:
    """A client of new workers on this machine, each a process with one thread; they end with the block, and all that
    they and Dask keep outside of outputs goes away with them.

    - `workers`: None: one a core, as far as tasks of `largest_bytes` have room in memory.
    - `memory_bytes`: limit of a worker; None: an equal share of the machine's memory.
    - `preload`: modules that a worker imports before its first task.
    """
    count = workers or max(1, min(CPU_COUNT, int(_usable(MEMORY_LIMIT) // max(largest_bytes, 1))))
    limit = memory_bytes or MEMORY_LIMIT // count
    with ExitStack() as opened:
        try:
            with scratch.signals_wait():
                work = str(opened.enter_context(scratch.folder()))
                opened.enter_context(dask.config.set({**SETTINGS, "temporary-directory": work}))
                cluster = opened.enter_context(
                    LocalCluster(
                        n_workers=count,
                        threads_per_worker=1,
                        processes=True,
                        host=LOOPBACK,
                        memory_limit=limit,
                        dashboard_address=f"{LOOPBACK}:0",
                        resources={RESOURCE: _usable(limit)},
                        preload=["avatar_export.batch.worker", *preload],
                        silence_logs=QUIET,
                        env={"TMPDIR": work},
                    )
                )
                client = opened.enter_context(Client(cluster, timeout=REACHED_S, set_as_default=False))
            yield client
        finally:
            with scratch.signals_wait():  # workers end within seconds; then nobody writes to the folder
                opened.close()


def _usable(limit: int) -> int:
    """Bytes that a worker may take before Dask ends it."""
    share = dask.config.get("distributed.worker.memory.terminate")
    return int(limit * share) if share else limit


def connected_again(address: str, security: Any) -> Client:
    """A new client of a scheduler to which a connection was cut. Raises AvatarError if none comes about for long."""
    until = time.monotonic() + PATIENCE_S
    while True:
        try:
            return _client(address, security)
        except OSError:
            if time.monotonic() > until:
                raise AvatarError(
                    "the connection was cut and did not come back; --resume does what is missing",
                    file=address,
                ) from None


@contextmanager
def scheduler_client(address: str) -> Iterator[Client]:
    """A client of the scheduler at `address`, tcp://HOST:PORT or tls://HOST:PORT; certificates as Dask is configured.

    Raises AvatarError if nothing answers there, or no scheduler.
    """
    parts = urlsplit(address)
    try:
        port = parts.port
    except ValueError:
        port = None
    host = parts.hostname
    if not host or not port or SCHEDULER.fullmatch(address) is None:
        raise AvatarError("is not tcp://HOST:PORT or tls://HOST:PORT", field="--scheduler")
    try:
        security = Security()  # as Dask is configured
        _knock(host, port, _context(security) if parts.scheme == "tls" else None)
        client = _client(address, security)
    except ssl.SSLError as error:
        raise AvatarError(
            f"the scheduler at {address} and this program do not trust each other's certificates "
            f"({error.reason or error}); one authority signs those of both",
            field="--scheduler",
        ) from None
    except (OSError, ValueError, TypeError) as error:
        raise AvatarError(
            f"no scheduler answers at {address} ({error}); start one with `dask scheduler`, or leave the option away "
            "for workers on this machine",
            field="--scheduler",
        ) from None
    with silence_logging_cmgr(QUIET), client:
        yield client


def _client(address: str, security: Security) -> Client:
    """A client of a scheduler. It does not print a table of what runs other versions: see `check`."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VersionMismatchWarning)
        return Client(address, security=security, timeout=REACHED_S, set_as_default=False)


def _context(security: Security) -> ssl.SSLContext:
    """What a client needs for TLS. Raises AvatarError if it is not configured, or names files that are wrong."""
    try:
        found = security.get_connection_args("client").get("ssl_context")
    except OSError as error:
        raise AvatarError(
            f"the certificates that Dask's settings name cannot be read ({error.strerror or error})",
            field="--scheduler",
        ) from None
    if not isinstance(found, ssl.SSLContext):
        raise AvatarError(
            "tls:// needs certificates: set DASK_DISTRIBUTED__COMM__TLS__CA_FILE, "
            "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT and DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY",
            field="--scheduler",
        )
    return found


def _knock(host: str, port: int, context: ssl.SSLContext | None) -> None:
    """Raises OSError if nothing listens there, or something else: a Client would wait for its greeting forever.

    A scheduler speaks first: the length of its greeting, 8 bytes.
    """
    with ExitStack() as stack:
        line = stack.enter_context(socket.create_connection((host, port), REACHED_S))
        if context is not None:
            line = stack.enter_context(context.wrap_socket(line, server_hostname=host))
        said = b""
        with suppress(TimeoutError):
            while len(said) < GREETED and (more := line.recv(GREETED - len(said))):
                said += more
        if len(said) < GREETED or int.from_bytes(said, "little") > LONGEST_GREETING:
            other = "" if context else ", or one whose address begins with tls://"
            raise OSError(f"the program that listens there is not a scheduler{other}")


def look(client: Client, versions: Mapping[str, Any]) -> Workers:
    """What the cluster's workers declare now. `versions`: what all processes run, as Dask tells it."""
    scheduler = versions["scheduler"]["packages"]
    dask_of = [
        given["packages"].get(DASK) for given in (versions["scheduler"], *versions["workers"].values())
    ]
    own = versions["client"]["packages"].get(DASK)
    info: dict[str, Any] = client.scheduler_info(n_workers=-1)  # some versions tell of five by default
    rows = list(info["workers"].values())
    memory = [row["resources"].get(RESOURCE) for row in rows]
    known = [int(size) for size in memory if size is not None]
    declared = bool(rows) and len(known) == len(rows)
    return Workers(
        slots=slots(client, declared),
        declared=declared,
        largest_bytes=max(known) if declared else None,
        dashboard=client.dashboard_link if scheduler.get(DASHBOARD) else None,
        other_dask=next((str(found) for found in dask_of if found != own), None),
    )


def slots(client: Client, declared: bool) -> int:
    """How many tasks can run at once now: one a thread if memory is `declared`, else one a worker.

    Raises OSError if the connection is cut.
    """
    threads = client.nthreads()
    return sum(threads.values()) if declared else len(threads)


def check(client: Client) -> Workers:
    """The workers, once there is one and each runs this package and this Python.

    Raises AvatarError for a cluster without workers, and for one whose workers run something else.
    """
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER_S)
    except TimeoutError:
        raise AvatarError(
            f"has no worker after {FIRST_WORKER_S:.0f} seconds; start some with `dask worker`",
            file=client.scheduler.address,
        ) from None
    versions = client.get_versions(packages=[DISTRIBUTION, DASHBOARD])
    own = _version(versions["client"])
    other = {
        worker: found
        for worker, found in ((name, _version(given)) for name, given in versions["workers"].items())
        if found != own
    }
    if other:
        named = "; ".join(f"{worker} runs {found}" for worker, found in list(other.items())[:MOST_NAMED])
        more = f" and {len(other) - MOST_NAMED} more" if len(other) > MOST_NAMED else ""
        raise AvatarError(
            f"{named}{more}, but this is {own}; install the same versions on every worker",
            file=client.scheduler.address,
        )
    return look(client, versions)


def _version(given: dict[str, Any]) -> str:
    """What a process runs, in words."""
    package = given["packages"].get(DISTRIBUTION) or "(not installed)"
    return f"{DISTRIBUTION} {package} on Python {'.'.join(given['host']['python'].split('.')[:2])}"
