"""A batch over two network namespaces that a veth pair joins, from and to an object store: needs root and `ip`.

python -m bench.batch.network FOLDER [--rows 300] [--kills 5] [--cuts 1]

One namespace has the store (moto's S3 server), the scheduler and a worker, the other a worker and the client. Workers
read their inputs from the store and write their outputs to it, through s3fs.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import s3fs

from avatar_export.batch import cluster, row
from bench.batch.command import Row, cpu_seconds, parsed, show
from bench.batch.lists import avatars_in

NEAR, FAR = "avatar-batch-a", "avatar-batch-b"  # namespaces
DEVICES = {NEAR: "avatar-a", FAR: "avatar-b"}
ADDRESSES = {NEAR: "10.77.0.1", FAR: "10.77.0.2"}
STORE, SCHEDULER = 5555, 8786  # ports
BUCKET = "avatars"
CREDENTIALS = {
    "AWS_ENDPOINT_URL": f"http://{ADDRESSES[NEAR]}:{STORE}",
    "AWS_ACCESS_KEY_ID": "somebody",
    "AWS_SECRET_ACCESS_KEY": "of-the-bench",
    "AWS_DEFAULT_REGION": "us-east-1",
    "AWS_EC2_METADATA_DISABLED": "true",
}
READY_S = 60.0


def ip(*arguments: str) -> None:
    """One command of iproute2."""
    subprocess.run(["ip", *arguments], check=True)


@contextmanager
def namespaces() -> Iterator[None]:
    """Both namespaces, joined."""
    try:
        for name in (NEAR, FAR):
            ip("netns", "add", name)
        ip("link", "add", DEVICES[NEAR], "netns", NEAR, "type", "veth", "peer", DEVICES[FAR], "netns", FAR)
        for name in (NEAR, FAR):
            ip("-n", name, "addr", "add", f"{ADDRESSES[name]}/24", "dev", DEVICES[name])
            for device in (DEVICES[name], "lo"):
                ip("-n", name, "link", "set", device, "up")
        yield
    finally:
        for name in (NEAR, FAR):
            subprocess.run(["ip", "netns", "delete", name], check=False)


@contextmanager
def program(namespace: str, *arguments: str) -> Iterator[None]:
    """A Python program in a namespace, ended with the block."""
    process = subprocess.Popen(
        ["ip", "netns", "exec", namespace, sys.executable, *arguments],
        env={**os.environ, **CREDENTIALS},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        process.terminate()
        process.wait()


def worker(namespace: str) -> tuple[str, ...]:
    """The command line of a worker."""
    here = ("--host", ADDRESSES[namespace], "--nthreads", "1", "--memory-limit", "3GB", "--no-dashboard")
    declared = ("--resources", f"{cluster.RESOURCE}=2850000000", "--preload", row.__name__)
    scheduler = f"tcp://{ADDRESSES[NEAR]}:{SCHEDULER}"
    return ("-m", "distributed.cli.dask_worker", scheduler, *here, *declared)


def upload(folder: Path) -> None:
    """Makes the avatars, and puts them into the store. Runs in a namespace."""
    avatars_in(folder)
    store = s3fs.S3FileSystem()
    until = time.monotonic() + READY_S
    while True:
        try:
            store.mkdir(BUCKET)
            break
        except OSError:
            if time.monotonic() > until:
                raise
            time.sleep(0.2)
    store.put(str(folder / "avatars"), f"{BUCKET}/in", recursive=True)


def network_rows(folder: Path, rows: int = 300, kills: int = 5, cuts: int = 1) -> list[Row]:
    """How the batch went; none where nobody may make namespaces."""
    if not shutil.which("ip") or os.geteuid():
        print("two network namespaces: not run, which needs root and ip")
        return []
    scheduler = ("--host", ADDRESSES[NEAR], "--port", str(SCHEDULER), "--no-dashboard")
    inside = ["ip", "netns", "exec", FAR, sys.executable, "-m"]
    environment = {**os.environ, **CREDENTIALS}
    cpu = cpu_seconds()
    with ExitStack() as stack:
        stack.enter_context(namespaces())
        stack.enter_context(program(NEAR, "-m", "moto.server", "-H", ADDRESSES[NEAR], "-p", str(STORE)))
        stack.enter_context(program(NEAR, "-m", "distributed.cli.dask_scheduler", *scheduler))
        for namespace in (NEAR, FAR):
            stack.enter_context(program(namespace, *worker(namespace)))
        sent = [*inside, "bench.batch.network", str(folder), "--upload"]
        subprocess.run(sent, env=environment, check=True)
        run = [*inside, "bench.batch.faults", str(folder), f"--rows={rows}", f"--kills={kills}"]
        run += [f"--cuts={cuts}", f"--sources=s3://{BUCKET}/in", f"--out=s3://{BUCKET}/out"]
        run += ["--scheduler", f"tcp://{ADDRESSES[NEAR]}:{SCHEDULER}"]
        printed = subprocess.run(run, env=environment, check=True, stdout=subprocess.PIPE, text=True).stdout
    lines = [line.split() for line in printed.splitlines()]
    found = [(name.replace("batch_", "batch_network_"), float(value), unit) for name, value, unit in lines]
    return [*found, ("batch_network_cpu_with_store_and_checks", cpu_seconds() - cpu, "s")]


if __name__ == "__main__":
    if sys.argv[2:] == ["--upload"]:  # what `network_rows` starts in a namespace
        upload(Path(sys.argv[1]))
    else:
        show(network_rows, parsed(__doc__, rows=300, kills=5, cuts=1))
