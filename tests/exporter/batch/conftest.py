"""Two workers of this machine, started once for all tests of this folder, and the avatars that they convert."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from bench.batch.lists import Row, rows_of
from distributed import Client

from avatar_export.batch import cluster, row
from tests.exporter.batch import avatars
from tests.session.shared_folder import made_once


@pytest.fixture(scope="session")
def client() -> Iterator[Client]:
    """A client of two workers that have imported what rows need. A task that kills two workers is given up."""
    with cluster.local_client(2, preload=(row.__name__,)) as client:
        client.cluster.scheduler.allowed_failures = 1
        yield client


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> list[Row]:
    """A row for an avatar of each system, made once."""
    folder = made_once(tmp_path_factory, "batch_avatars", avatars.make_all)
    return rows_of(folder)


def kill_worker(client: Client, index: int) -> None:
    """SIGKILL to one of the worker processes that there are now."""
    pids = sorted(client.run(os.getpid).values())
    os.kill(pids[index % len(pids)], signal.SIGKILL)
