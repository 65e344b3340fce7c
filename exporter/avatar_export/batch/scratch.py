"""The folder of a row for copies and for files that are not kept. What killed workers left there is removed."""

from __future__ import annotations

import os
import re
import shutil
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from avatar_export.batch.locations import STORES
from avatar_runtime.io.staging import lives

START = "avatar-batch"
FOLDER = re.compile(rf"{START}-(.+)-([0-9]{{1,9}})-[^-]*")  # host, process
COPIES = re.compile(rf"\S*/{START}-[^/]+/({'|'.join(set(STORES.values()))})/")


@contextmanager
def folder() -> Iterator[Path]:
    """An empty folder on the worker's disk (TMPDIR), which goes away with the block. Raises OSError."""
    for left in Path(tempfile.gettempdir()).glob(f"{START}-*"):
        found = FOLDER.fullmatch(left.name)
        if found and is_dead(found[1], int(found[2])):
            shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=f"{START}-{own_process()}-") as work:
        yield Path(work)


def own_process() -> str:
    """HOST-NUMBER of this process, for names of what it must not leave behind."""
    return f"{socket.gethostname()}-{os.getpid()}"


def is_dead(host: str, process: int) -> bool:
    """Whether a process of this machine is gone; of another machine nobody knows."""
    return host == socket.gethostname() and process != os.getpid() and not lives(process)


def originals(text: str) -> str:
    """`text` with the URL of each input in place of the path of its copy."""
    return COPIES.sub(r"\1://", text)
