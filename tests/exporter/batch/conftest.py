"""Two workers of this machine, started once for all tests of this folder, and the avatars that they convert."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from bench.batch.lists import Row, rows_of
from distributed import Client, LocalCluster

from avatar_export.asm.files import save
from avatar_export.batch import cluster, row
from tests.asm_faces import small_face
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


QUICK: dict[str, Any] = {"preview": False, "engine_files": False, "reference": False}


@pytest.fixture(scope="session")
def face(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The smallest trained avatar."""
    path = tmp_path_factory.mktemp("face") / "face.npz"
    save(small_face(), path)
    return path


@contextmanager
def cluster_here(workers: int, **options: Any) -> Iterator[LocalCluster]:
    """A cluster in this process, on the loopback device."""
    usual = {"protocol": "tcp", "host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "processes": False}
    with LocalCluster(n_workers=workers, **usual | options) as made:
        yield made


@contextmanager
def client_here(workers: int, **options: Any) -> Iterator[Client]:
    with cluster_here(workers, **options) as made, Client(made, set_as_default=False) as client:
        yield client


def kill_worker(client: Client, index: int) -> None:
    """SIGKILL to one of the worker processes that there are now."""
    pids = sorted(client.run(os.getpid).values())
    os.kill(pids[index % len(pids)], signal.SIGKILL)
