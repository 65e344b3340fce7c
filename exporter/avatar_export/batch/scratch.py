"""The folder of a row, or of a batch, for copies and for files that are not kept: nothing stays when it ends.

What killed processes left there is removed.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from avatar_export.batch.locations import STORES
from avatar_runtime.io.staging import lives

START = "avatar-batch"
ENDING = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
FOLDER = re.compile(rf"{START}-(.+)-([0-9]{{1,9}})-[^-]*")  # host, process
COPIES = re.compile(rf"\S*/{START}-[^/]+/({'|'.join(set(STORES.values()))})/")


@contextmanager
def folder() -> Iterator[Path]:
    """An empty folder on this machine's disk (TMPDIR), which goes away with the block. Raises OSError."""
    for left in Path(tempfile.gettempdir()).glob(f"{START}-*"):
        found = FOLDER.fullmatch(left.name)
        if found and is_dead(found[1], int(found[2])):
            shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=f"{START}-{own_process()}-") as work:
        yield Path(work)


@contextmanager
def signals_wait() -> Iterator[None]:
    """Signals that end the process act when the block has ended: it starts processes, or ends them.

    Changes nothing outside of the main thread, where signals do not arrive.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {number: signal.getsignal(number) for number in ENDING}
    for number, handler in before.items():
        if handler not in (signal.SIG_IGN, None):  # None: set by C code
            signal.signal(number, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            if handler is not None:
                signal.signal(number, handler)
        if came:
            signal.raise_signal(came[0])


def own_process() -> str:
    """HOST-NUMBER of this process, for names of what it must not leave behind."""
    return f"{socket.gethostname()}-{os.getpid()}"


def is_dead(host: str, process: int) -> bool:
    """Whether a process of this machine is gone; of another machine nobody knows."""
    return host == socket.gethostname() and process != os.getpid() and not lives(process)


def originals(text: str) -> str:
    """`text` with the URL of each input in place of the path of its copy."""
    return COPIES.sub(r"\1://", text)
